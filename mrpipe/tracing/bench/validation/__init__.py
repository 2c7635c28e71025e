"""Errors on the validation tests, and the class of the verdict that follows from them.

It compares the validation tests with the training tests, because they can differ, and judges the chosen model on the
part that is comparable.
"""
