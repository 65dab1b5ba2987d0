halrun -v cross-thread-io.hal
