"""The virtual rig: it simulates the hardware, and only the stages `record` import it.

Its physics are its own: no equation is shared with the estimators, and planted effects have other forms than the
candidates that the program traces.
"""
