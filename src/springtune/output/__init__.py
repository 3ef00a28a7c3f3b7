"""What results are written as: the dataset, figures and tables."""
