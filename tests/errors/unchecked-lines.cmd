hal check --assume motmod unchecked-lines.hal
