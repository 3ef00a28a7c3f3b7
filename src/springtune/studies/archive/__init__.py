"""Archives of studies, their parts at several sites, object storage, and checks of what is stored."""
