"""Translation of compiled steps (a small part of Python) to other languages.

A damper is a chain of small compiled functions. Each exported damper contains exactly the steps of its chain, so
that base forms and effects, also those of a user's own file, need no second version of their equations.
"""
