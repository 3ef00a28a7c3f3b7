"""Jobs: stored results and their keys, what they depend on and cost, files that appear whole or not at all."""
