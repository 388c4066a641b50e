"""llms.txt: the list of all pages for language models, which is made from the pages."""
