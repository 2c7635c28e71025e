"""Bench rigs for the tracing benchmark, integrated independently of the program.

Nothing here imports the program's dampers, effects or virtual laboratory: a benchmark that shares formulas or code with
the program would only measure whether the program recognises itself. Only :mod:`benchmarks.rigs.campaign` uses the
writer of campaign files.
"""
