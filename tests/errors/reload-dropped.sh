# SPDX-License-Identifier: MIT
# Two versions of one plugin: the netlist exchanges them.
export VERSIONS="${HALCYON_PLUGIN_PATH#*:}" HALCYON_PLUGIN_PATH="$HOME/plugins:${HALCYON_PLUGIN_PATH#*:}"
mkdir "$HOME/plugins"
cp "$VERSIONS/test_reload_old.so" "$HOME/plugins/test-reload.so"
exec hal sim --quiet reload-dropped.hal
