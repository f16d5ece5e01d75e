"""Gains found automatically: a search that a scenario describes and that a scenario's own ensembles judge."""
