halrun -v cyclic-order.hal
