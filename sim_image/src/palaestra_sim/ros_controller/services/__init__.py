"""The services of Webots' `ros` controller, one module per group, each a table of paths, types and handlers.

Handlers get a request with the type's fields as attributes and return the response's fields.
"""
