"""Engines: programs that others run springs in, and the textbook solvers behind them; one module each."""
