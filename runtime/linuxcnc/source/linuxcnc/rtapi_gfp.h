/* SPDX-License-Identifier: MIT */
/* Memory comes from the C library, whatever the flag. */
#ifndef RTAPI_GFP_H
#define RTAPI_GFP_H

enum rtapi_gfp_e {
    RTAPI_GFP_KERNEL,
    RTAPI_GFP_ATOMIC,
    RTAPI_GFP_DMA,
    RTAPI_GFP_NOWAIT,
    RTAPI_GFP_NOIO,
    RTAPI_GFP_NOFS,
    RTAPI_GFP_USER
};
typedef unsigned long rtapi_gfp_t;
#endif
