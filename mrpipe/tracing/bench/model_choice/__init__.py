"""Choice of a model by races, together with its weights, the filter of the displacement and the rate of the fits.

The races are repeated if the chosen model shows that other weights, another filter or another rate are better.
"""
