hal run no-such-node.hal --node finger
