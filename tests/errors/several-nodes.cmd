hal run several-nodes.hal --for 1ms
