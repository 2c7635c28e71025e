"""The part of the report before the appendix: result, trust, damper, structure, control, next steps."""
