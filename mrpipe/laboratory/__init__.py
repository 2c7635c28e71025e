"""The virtual rig: it stands in for the hardware and is known to its own stages alone.

Its physics are its own: no equation is shared with the estimators, and planted effects have other forms than the
candidates that the program traces.
"""
