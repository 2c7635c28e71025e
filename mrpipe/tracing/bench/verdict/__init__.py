"""Names of effects with probabilities, the verdict in words, and the result as JSON.

This is the last step of a tracing. It uses the chosen model, its rivals and its errors on the validation tests.
"""
