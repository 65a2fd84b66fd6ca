"""The live editor: move boxes in the browser, see the relations follow, repair."""
