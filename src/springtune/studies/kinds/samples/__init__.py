"""Samples: scenes of continuous parameters that are drawn at random, and which of these matter."""
