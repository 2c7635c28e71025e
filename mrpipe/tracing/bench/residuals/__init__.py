"""What the residual of a fit contains.

It has measures of the error, of its structure, of the part that a flexible model recovers, of the gain on tests left
out, and of artefacts of the measurement. The choice of a model and the verdict both use these measures.
"""
