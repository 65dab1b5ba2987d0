hal check --assume hal_card unchecked-lines.hal
