/* SPDX-License-Identifier: MIT */
/*
 * The C11 boundary between the Halcyon runtime (the host) and a component plugin.
 *
 * A plugin exports one symbol, `hal_plugin`. The runtime, `hal doc`, `hal check` and every unit
 * test are hosts of this same interface. Rules: structs that may grow begin with their size and
 * grow at the end; within a major version nothing is renamed or removed; no exception, no C++ type
 * and no ownership of memory crosses. Every function names the thread it may be called from:
 *   [setup]     an ordinary thread, no cycle of this instance is running
 *   [realtime]  inside a cycle: must not allocate, lock, block, log or throw
 *   [any]       either
 */
#ifndef HAL_ABI_H
#define HAL_ABI_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define HAL_ABI_MAJOR 1
#define HAL_ABI_MINOR 3

typedef enum hal_type { HAL_TYPE_BIT, HAL_TYPE_FLOAT, HAL_TYPE_S32, HAL_TYPE_U32, HAL_TYPE_S64, HAL_TYPE_U64, HAL_TYPE_PORT } hal_type;
typedef enum hal_dir { HAL_DIR_IN, HAL_DIR_OUT, HAL_DIR_IO, HAL_DIR_PARAM } hal_dir;

/* A byte stream between one writer and one reader. The host owns it; `head` is written by the
 * writer only, `tail` by the reader only, both count bytes for ever (index = count % capacity). */
typedef struct hal_port {
    uint32_t capacity; /* bytes; 0 until `sets SIGNAL BYTES` */
    uint32_t pad;
    uint64_t head, tail;
    uint8_t *data;
} hal_port;

/* One slot: eight bytes, whatever the type. `raw` is first, so that `= {0}` clears all of it. */
typedef union hal_value {
    uint64_t raw;
    bool bit;
    double real;
    int32_t s32;
    uint32_t u32;
    int64_t s64;
    uint64_t u64;
    hal_port *port;
} hal_value;

/* A pin in the memory of its instance. While the pin is not linked, `slot` points to `own`. Only
 * the host changes `slot`, at the beginning of a cycle of the thread the pin belongs to. */
typedef struct hal_pin {
    hal_value *slot;
    hal_value own;
} hal_pin;

enum {
    HAL_PIN_FINITE = 1, /* NaN or infinity on this float output is a fault */
    HAL_PIN_SAFE = 2,   /* `safe` is written on stop, unload, a fault that stops the thread, end of process */
    HAL_PIN_READ_ONLY = 4 /* since 1.1: a parameter that only its component sets */
};

typedef struct hal_pin_decl {
    uint32_t size;
    hal_type type;
    hal_dir dir;
    uint32_t flags;
    const char *name; /* below the instance's name; copied by the host, as are doc and unit */
    const char *doc;
    const char *unit;
    hal_value initial, safe;
    const void *function; /* `identity` of the one function that uses the pin; NULL: all of them do */
    hal_value **pointer;  /* since 1.1: NULL, or a pointer in the plugin that the host keeps equal to `slot` */
} hal_pin_decl;

#define HAL_PIN_DECL_SIZE_1_0 offsetof(hal_pin_decl, pointer)

/* One cycle, as a function sees it. Valid during the call only. */
typedef struct hal_cycle {
    uint32_t size;
    uint32_t pad;
    int64_t period_ns; /* nominal period of the thread */
    double period_s;   /* the same in seconds */
    int64_t start_ns;  /* when this cycle was due, on the runtime's clock */
    uint64_t number;   /* cycles of this thread since it started, skipped ones included */
} hal_cycle;

typedef void (*hal_step)(void *self, const hal_cycle *cycle); /* [realtime] */

/* One call of a thread's cycle. */
typedef struct hal_call {
    hal_step step;
    void *self;
} hal_call;

/* Since 1.1: does `*current = call; call->step(call->self, cycle)` for each call in [first, last),
 * which all have the same step. `current` shows the host the running call, in case it does not
 * return. [realtime] */
typedef void (*hal_row)(const hal_call *first, const hal_call *last, const hal_cycle *cycle, const hal_call *volatile *current);

enum {
    HAL_FUNCTION_SHARED = 1,   /* one function per component, running all its instances in order of creation */
    HAL_FUNCTION_EMERGENCY = 2, /* never in a thread: the host calls it to make hardware outputs safe; async-signal-safe */
    HAL_FUNCTION_REQUIRED = 4 /* since 1.2: the other functions of the instance do not work while this one is in no thread */
};

typedef struct hal_function_decl {
    uint32_t size;
    uint32_t flags;
    const char *name; /* below the instance's (or, if shared, the component's) name; "" is that name itself */
    const char *doc;
    hal_step step;
    void *self;
    const void *identity;
    hal_row row; /* since 1.1: NULL, or runs many consecutive calls in one loop */
} hal_function_decl;

#define HAL_FUNCTION_DECL_SIZE_1_0 offsetof(hal_function_decl, row)

enum {
    HAL_ARGUMENT_PER_INSTANCE = 1 /* a comma list, an element per instance; its length is the number of instances
                                     when neither count= nor names= is given */
};

typedef struct hal_argument_decl {
    uint32_t size;
    uint32_t flags;
    const char *name, *doc;
    const char *fallback; /* text of the default */
} hal_argument_decl;

/* What a rejection is about. */
typedef enum hal_subject { HAL_SUBJECT_INSTANCE, HAL_SUBJECT_ARGUMENT, HAL_SUBJECT_PIN } hal_subject;

/* Since 1.2: why create or start returns false. The host copies all texts; it reads only the first
 * `size` bytes. */
typedef struct hal_rejection {
    uint32_t size;
    hal_subject subject;
    const char *name;    /* of the argument, or of the pin below the instance's name; "" for the instance */
    uint32_t begin, end; /* the invalid bytes of the argument's value; begin == end: all of it */
    const char *code;    /* a code that `hal explain` knows; "" leaves the choice to the host */
    const char *text;    /* one sentence without a final full stop that includes the invalid value */
    const char *help;    /* what to type, or "" */
} hal_rejection;

/* What the host offers while an instance is created and started: all [setup]. */
typedef struct hal_host {
    uint32_t size;
    void *data;
    bool (*pin)(const struct hal_host *, const hal_pin_decl *, hal_pin *);  /* false: create must fail */
    bool (*function)(const struct hal_host *, const hal_function_decl *);   /* false: create must fail */
    const char *(*argument)(const struct hal_host *, const hal_argument_decl *); /* valid until create returns */
    void *(*allocate)(const struct hal_host *, size_t bytes, size_t align); /* zeroed, lives as long as the instance */
    void (*fail)(const struct hal_host *, const char *reason);              /* why create or start will return false */
    const void *(*extension)(const struct hal_host *, const char *id);      /* NULL when the host has none */
    /* Since 1.2: like fail(), with the cause typed. The first call of fail() or reject() counts. A
     * host that is older has a smaller `size`: a plugin then passes the text to fail(). A plugin
     * that is older calls fail() only: the host reports its reason for the instance. */
    void (*reject)(const struct hal_host *, const hal_rejection *);
} hal_host;

#define HAL_HOST_SIZE_1_1 offsetof(hal_host, reject)

enum {
    HAL_COMPONENT_SINGLETON = 1, /* one instance, named like the component without a number */
    HAL_COMPONENT_STARTS = 2,    /* start or stop does something (since 1.1): a reload stops the old before it starts the new */
    HAL_COMPONENT_WHOLE_NAMES = 4, /* since 1.1: names of pins and functions are complete, without the name of the instance;
                                      names=, count=, num_chan= and personality= are ordinary arguments */
    HAL_COMPONENT_LOOSE_PINS = 8   /* since 1.1: functions in different threads may use the same pin: then its signal is one
                                      cell that all of them access directly */
};

typedef struct hal_component {
    uint32_t size;
    uint16_t abi_major, abi_minor;
    const char *name, *summary, *doc; /* name as loadrt takes it; doc in Markdown, may be "" */
    uint32_t flags;
    uint32_t default_count;
    size_t instance_size, instance_align; /* the host gives `create` this much zeroed memory */
    bool (*create)(const hal_host *, void *memory);  /* [setup] declares; touches no hardware */
    bool (*start)(void *self, const hal_host *);     /* [setup] acquires hardware; false after fail() */
    void (*stop)(void *self);                        /* [setup] releases hardware, outputs safe */
    void (*destroy)(void *self);                     /* [setup] */
} hal_component;

/* Extension "hal.stream/1": a FIFO of records between a component and programs outside (sampler,
 * streamer). One producer, one consumer; head and tail count records for ever and are accessed
 * atomically. */
typedef struct hal_stream {
    uint32_t size;
    uint32_t columns;    /* values per record */
    uint32_t depth;      /* records */
    uint32_t to_machine; /* 0: the component produces (sampler); 1: it consumes (streamer) */
    const char *types;   /* a letter per column: b f s u l k (bit float s32 u32 s64 u64) */
    hal_value *data;     /* depth * (columns + 1) values; the last of a record is its sample number */
    uint64_t head, tail;
    uint64_t lost;       /* overruns (producer) or underruns (consumer) */
} hal_stream;

typedef struct hal_stream_host {
    uint32_t size;
    /* [setup] in start; withdrawn at stop. `name` is below the instance's name; "" is that name
     * itself. */
    bool (*publish)(const hal_host *, const char *name, hal_stream *);
} hal_stream_host;

/* Extension "hal.faults/1": the runtime's fault record, for a safety chain and for components that
 * detect faults. */
typedef struct hal_faults {
    uint32_t size;
    uint32_t pad;
    uint64_t count;       /* faults since the start; written by the host, read atomically [any] */
    uint64_t cleared;     /* value of count at the last `fault clear` */
    uint32_t last_code;   /* hal_fault_code of the newest */
    uint32_t last_thread; /* index of its thread */
    uint64_t last_cycle;
    void (*clear)(const struct hal_faults *);                                  /* [realtime] acknowledges all */
    void (*raise)(const struct hal_faults *, const void *self, const char *reason, double detail); /* [realtime]
                              reason: a string that lives as long as the instance. `detail` replaces {}, is appended if there is no {}, or is omitted if it is NaN;
                              the reaction follows a semicolon: "node 5: no heartbeat for {} s; outputs set to safe values" */
} hal_faults;

typedef enum hal_fault_code {
    HAL_FAULT_NONE, HAL_FAULT_EXCEPTION, HAL_FAULT_NOT_FINITE, HAL_FAULT_BUDGET, HAL_FAULT_SILENT_THREAD, HAL_FAULT_COMPONENT,
    HAL_FAULT_VIOLATION /* since 1.3 */
} hal_fault_code;

/* Extension "hal.clock/1": lets one instance discipline the deadlines of all threads to an external
 * clock reference. */
typedef struct hal_clock {
    uint32_t size;
    uint32_t pad;
    int64_t shift_ns; /* sum of all clock adjustments; written by the host, read atomically [any] */
    int64_t limit_ns; /* largest adjustment per cycle in either direction: a tenth of the period of the fastest thread; read
                         atomically [any] */
    /* [realtime] in a cycle of the leading instance only: delays (negative: advances) all later
       deadlines of all threads by `ns`, so that their relative phase is kept. hal_cycle.start_ns is
       the adjusted time. */
    void (*step)(const struct hal_clock *, int64_t ns);
    /* [setup] in start: this instance leads until it is stopped. false, after fail(): another
     * instance leads. */
    bool (*claim)(const struct hal_clock *, const hal_host *);
} hal_clock;

#ifndef HAL_EXPORT
#define HAL_EXPORT __attribute__((visibility("default")))
#endif

extern HAL_EXPORT const hal_component hal_plugin; /* the one symbol a plugin exports */

#ifdef __cplusplus
}
#endif
#endif
