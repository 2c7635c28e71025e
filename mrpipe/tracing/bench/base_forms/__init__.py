"""Comparison of base forms, without effects and with the effects that they need: the race.

It searches effects under the best base forms by means of the selection, and fits the winner to all training tests.
"""
