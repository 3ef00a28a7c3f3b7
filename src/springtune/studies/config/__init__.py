"""From a YAML file to a Study: models, checks, expansion, and messages with lines."""
