"""The dataset of a study, and what is made from it: figures, tables, exports, comparisons and the page to browse."""
