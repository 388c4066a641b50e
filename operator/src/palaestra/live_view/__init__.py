"""A live view of running simulators in a browser of this machine.

The view runs where the person is. It reads what sidecars serve (`source`), draws it (`stage`), and serves one
page on the loopback interface (`guarded_server`); nothing of it runs in a trainer or a simulator. A view that
nobody looks at reads nothing.
"""
