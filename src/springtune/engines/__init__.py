"""Simulators that run springs (Newton, MuJoCo), and textbook solvers (XPBD, VBD); one module each."""
