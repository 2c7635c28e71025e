"""The virtual rig: it simulates the hardware, and only the stages `record` import it.

Its equations are independent of the estimators, and its planted effects have other forms than the candidates that the
program traces.
"""
