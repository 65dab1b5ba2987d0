/* SPDX-License-Identifier: MIT */
/* Reads three records of sampler 0, as halsampler does, and changes what the module follow keeps in memory of a key. */
#include "declared.h"

int main(void) {
    const int comp = hal_init("reader");
    hal_stream_t stream;
    if (comp <= 0) return 1;
    printf("other key %d, other types %d\n", hal_stream_attach(&stream, comp, 0x48534139, NULL),
           hal_stream_attach(&stream, comp, 0x48534130, "ff"));
    if (hal_stream_attach(&stream, comp, 0x48534130, "fs") != 0 || hal_ready(comp) != 0) return 2;
    uint64_t row[3];
    int last = 0;
    for (int i = 0; i < 3; ++i) {
        unsigned number = 0;
        hal_stream_wait_readable(&stream, NULL);
        if (hal_stream_read(&stream, row, &number) != 0) return 3;
        double real;
        memcpy(&real, row, sizeof real);
        if (i > 0) {
            printf("%g %d, the next: %d\n", real, (int)(int32_t)row[1], (int)number - last);
        }
        last = (int)number;
    }
    hal_stream_detach(&stream);
    return hal_exit(comp);
}
