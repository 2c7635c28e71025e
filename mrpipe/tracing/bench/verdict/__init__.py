"""Names of effects with probabilities, the verdict in words, and the result as JSON.

The last step before :mod:`mrpipe.tracing.bench.trace` combines all steps: it uses the chosen model, its rivals and its
errors on the validation tests.
"""
