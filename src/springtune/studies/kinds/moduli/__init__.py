"""Effective moduli of definitions, measured on patches."""
