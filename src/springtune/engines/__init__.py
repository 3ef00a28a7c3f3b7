"""Engines: programs that others run springs in, and the textbook solvers behind them; one module each.

`base` declares an engine, `run` moves a scene in one until it rests.
"""
