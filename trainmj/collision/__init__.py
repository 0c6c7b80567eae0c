"""One collision, and many: the device law, the mechanical system, MuJoCo's model of it, what it leaves and means."""
