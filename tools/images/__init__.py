"""Build the container images of Palaestra: the program of `make images`.

An image is made from its Dockerfile, its share of `requirements.lock` as wheels, and our own packages;
all of it is put into a folder first, so a build needs no package index of Python. Its archive is named
by the content of what goes in: nothing is built twice, and nothing stale is used.
"""
