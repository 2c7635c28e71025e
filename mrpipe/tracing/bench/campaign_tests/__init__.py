"""What the tests of a campaign can show, before and after a tracing.

It finds tests that contradict the others, decides which effects the tests can show, and proposes further tests. It is
the first step and imports no other package of the bench tracing.
"""
