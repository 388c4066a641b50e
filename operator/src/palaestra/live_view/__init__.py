"""A live view of running simulators in a browser of this machine.

The view runs on the person's own machine, and not in a trainer or a simulator. It reads the scene from
sidecars (`source`), draws the scene (`stage`), and serves one page on the loopback interface
(`guarded_server`). A program shows its own run from another process (`view_process`). Once the page is
served, the view sends requests only while a browser is connected.
"""
