/* SPDX-License-Identifier: MIT */
/*
 * Extension "hal.texts/1", offered while an instance is created: reports errors in a file that the
 * component reads in the same form as errors of the netlist.
 */
#ifndef HAL_TEXTS_H
#define HAL_TEXTS_H

#include "hal/abi.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_TEXTS "hal.texts/1"

typedef enum hal_severity { HAL_SEVERITY_NOTE, HAL_SEVERITY_WARNING, HAL_SEVERITY_ERROR } hal_severity;

typedef struct hal_text_message {
    uint32_t size;
    hal_severity severity;
    const char *code;      /* one of `hal explain` */
    uint32_t begin, end;   /* bytes of the text */
    const char *sentence;  /* no final stop */
    const char *label;     /* text under the span, or "" */
    const char *help;      /* what to type, or "" */
} hal_text_message;

typedef struct hal_texts {
    uint32_t size;
    /* Returns the path of `file`: beside the netlist that loads the component, or else as written.
     * Valid until create returns. [setup] */
    const char *(*find)(const hal_host *, const char *file);
    /* Sets the text, and its name, to which the following messages refer. Without a name they refer
     * to the command that loads the component. [setup] */
    void (*begin)(const hal_host *, const char *name, const char *text, size_t bytes);
    /* Reports a message. After an error create must fail; fail() is then unnecessary. [setup] */
    void (*report)(const hal_host *, const hal_text_message *);
} hal_texts;

#ifdef __cplusplus
}
#endif
#endif
