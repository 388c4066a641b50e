"""Build the container images of Palaestra: the program of `make images`.

An image is made from its Dockerfile, from wheels of its part of `requirements.lock`, and from our packages.
The program first copies all of them into a folder, so a build needs no package index of Python. The name of
an image's archive has a digest of its inputs, so no image is built twice, and no outdated image is used.
"""
