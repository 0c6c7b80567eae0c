"""The laws of devices, a module for each kind.

A law is one function of plain numbers, ``respond``: :class:`~trainmj.collision.device.Envelope` calls it as it stands,
and :mod:`~trainmj.collision.kernel` compiles it into the callback of MuJoCo. A module of this package imports nothing.
To add a kind, write its module, give it a code here, and name the code in the kernel's dispatch and in the device's
data.
"""

CRUSH = 0
"""Code of :mod:`~trainmj.collision.law.crush`."""
