"""Tables from the dataset: CSV files, and one HTML page that sets ours beside the paper's."""
