/* SPDX-License-Identifier: MIT */
/* The numbers and results of gomath.h. */
#ifndef HALCYON_GOTYPES_H
#define HALCYON_GOTYPES_H

#include <float.h>
#include <limits.h>

typedef double go_real;
typedef int go_integer;
typedef unsigned char go_flag;

#define GO_REAL_DOUBLE
#define GO_REAL_MIN DBL_MIN
#define GO_REAL_MAX DBL_MAX
#define GO_REAL_EPSILON (1.0e-7)
#define GO_INF DBL_MAX
#define GO_INTEGER_INT
#define GO_INTEGER_MAX INT_MAX
#define GO_FLAG_UCHAR

enum {
    GO_RESULT_OK,
    GO_RESULT_IGNORED,
    GO_RESULT_BAD_ARGS,
    GO_RESULT_RANGE_ERROR,
    GO_RESULT_DOMAIN_ERROR,
    GO_RESULT_ERROR,
    GO_RESULT_IMPL_ERROR,
    GO_RESULT_NORM_ERROR,
    GO_RESULT_DIV_ERROR,
    GO_RESULT_SINGULAR,
    GO_RESULT_NO_SPACE,
    GO_RESULT_EMPTY,
    GO_RESULT_BUG
};

/* What a joint moves. */
enum { GO_QUANTITY_NONE, GO_QUANTITY_LENGTH, GO_QUANTITY_ANGLE };

static inline const char* go_result_to_string(int result) {
    static const char* const names[] = {"Ok",
                                        "Ignored",
                                        "Bad Args",
                                        "Range Error",
                                        "Domain Error",
                                        "General Error",
                                        "Implementation Error",
                                        "Norm Error",
                                        "Div Error",
                                        "Singular",
                                        "No Space",
                                        "Empty",
                                        "Bug"};
    return result >= 0 && result <= GO_RESULT_BUG ? names[result] : "?";
}
static inline const char* go_quantity_to_string(int quantity) {
    if (quantity == GO_QUANTITY_LENGTH) return "Length";
    if (quantity == GO_QUANTITY_ANGLE) return "Angle";
    return "None";
}

#endif
