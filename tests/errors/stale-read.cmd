halrun -v stale-read.hal
