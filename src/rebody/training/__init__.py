"""Pipelines: state in, state out."""
