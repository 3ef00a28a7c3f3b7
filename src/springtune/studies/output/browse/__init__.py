"""The page to browse a dataset with: one file that needs neither a server nor a network."""
