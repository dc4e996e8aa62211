"""Pure functions of frames and series: what they tell, and the tables of it.

On `dem.record` and `postprocess.statistics` alone: measures know nothing of reports and
pictures. A measure is one file with one registration, see `postprocess.measures.registry`.
"""
