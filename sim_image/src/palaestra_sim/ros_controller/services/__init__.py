"""The services of Webots' `ros` controller, with one module for each group of services.

Each module has a table of paths, types and handlers. A handler gets a request, whose attributes are the
fields of its type, and returns the fields of the response.
"""
