/* SPDX-License-Identifier: MIT */
/* Part of gomath.h: matrices of any size in memory of their own, square ones of 3, 4 and 6 rows,
 * complex numbers and polynomials. */
#ifndef HALCYON_GOMATH_MATRIX_H
#define HALCYON_GOMATH_MATRIX_H

typedef go_real go_vector;
typedef struct {
    go_integer rows, cols;
    go_real **el, **elcpy; /* rows of elements, and as many for the work of go_matrix_inv */
    go_real* v;
    go_integer* index;
} go_matrix;

/* GO_MATRIX_DECLARE(m, m_space, 3, 4); go_matrix_init(m, m_space, 3, 4); makes a matrix on the
 * stack. */
#define GO_MATRIX_DECLARE(m, space, row_count, col_count)                \
    go_matrix m = {0, 0, 0, 0, 0, 0};                                    \
    struct {                                                             \
        go_real *el[row_count], *elcpy[row_count];                       \
        go_real stg[row_count][col_count], stgcpy[row_count][col_count]; \
        go_real v[row_count];                                            \
        go_integer index[row_count];                                     \
    } space
#define go_matrix_init(m, space, row_count, col_count)                                          \
    do {                                                                                        \
        for (go_integer __row = 0; __row < (row_count); ++__row) {                              \
            space.el[__row] = space.stg[__row];                                                 \
            space.elcpy[__row] = space.stgcpy[__row];                                           \
        }                                                                                       \
        m = (go_matrix){(row_count), (col_count), space.el, space.elcpy, space.v, space.index}; \
    } while (0)

static inline go_real* __go_singular_epsilon(void) {
    static go_real epsilon = 1.0e-8;
    return &epsilon;
}
static inline go_real go_get_singular_epsilon(void) { return *__go_singular_epsilon(); }
static inline int go_set_singular_epsilon(go_real epsilon) {
    *__go_singular_epsilon() = epsilon;
    return GO_RESULT_OK;
}

static inline int go_cart_vector_convert(const go_cart* c, go_vector* v) {
    v[0] = c->x;
    v[1] = c->y;
    v[2] = c->z;
    return GO_RESULT_OK;
}
static inline int go_vector_cart_convert(const go_real* v, go_cart* c) {
    *c = (go_cart){v[0], v[1], v[2]};
    return GO_RESULT_OK;
}

static inline go_flag __go_same_size(const go_matrix* a, const go_matrix* b) {
    return a->rows == b->rows && a->cols == b->cols;
}

static inline int go_mat_matrix_convert(const go_mat* mat, go_matrix* to) {
    const go_cart* const columns[3] = {&mat->x, &mat->y, &mat->z};
    if (!to->el || to->rows != 3 || to->cols != 3) return GO_RESULT_ERROR;
    for (int i = 0; i < 3; ++i) {
        to->el[0][i] = columns[i]->x;
        to->el[1][i] = columns[i]->y;
        to->el[2][i] = columns[i]->z;
    }
    return GO_RESULT_OK;
}
static inline int go_quat_matrix_convert(const go_quat* q, go_matrix* to) {
    go_mat mat;
    const int result = go_quat_mat_convert(q, &mat);
    return result != GO_RESULT_OK ? result : go_mat_matrix_convert(&mat, to);
}
static inline int go_matrix_matrix_copy(const go_matrix* from, go_matrix* to) {
    if (!from->el || !to->el || !__go_same_size(from, to)) return GO_RESULT_ERROR;
    for (go_integer i = 0; i < to->rows; ++i) {
        for (go_integer j = 0; j < to->cols; ++j) {
            to->el[i][j] = from->el[i][j];
        }
    }
    return GO_RESULT_OK;
}
static inline int go_matrix_matrix_add(const go_matrix* a, const go_matrix* b, go_matrix* to) {
    if (!a->el || !b->el || !to->el || !__go_same_size(a, b) || !__go_same_size(a, to)) {
        return GO_RESULT_ERROR;
    }
    for (go_integer i = 0; i < to->rows; ++i) {
        for (go_integer j = 0; j < to->cols; ++j) {
            to->el[i][j] = a->el[i][j] + b->el[i][j];
        }
    }
    return GO_RESULT_OK;
}
/* `to` may be one of the factors: the product is made in its second memory. */
static inline int go_matrix_matrix_mult(const go_matrix* a, const go_matrix* b, go_matrix* to) {
    if (!a->el || !b->el || !to->el || a->cols != b->rows || to->rows != a->rows ||
        to->cols != b->cols) {
        return GO_RESULT_ERROR;
    }
    for (go_integer i = 0; i < to->rows; ++i) {
        for (go_integer j = 0; j < to->cols; ++j) {
            go_real sum = 0.0;
            for (go_integer k = 0; k < a->cols; ++k) {
                sum += a->el[i][k] * b->el[k][j];
            }
            to->elcpy[i][j] = sum;
        }
    }
    for (go_integer i = 0; i < to->rows; ++i) {
        for (go_integer j = 0; j < to->cols; ++j) {
            to->el[i][j] = to->elcpy[i][j];
        }
    }
    return GO_RESULT_OK;
}
/* `to` may be `v` where the matrix is square. */
static inline int go_matrix_vector_mult(const go_matrix* a, const go_vector* v, go_vector* to) {
    if (!a->el) return GO_RESULT_ERROR;
    for (go_integer i = 0; i < a->rows; ++i) {
        a->v[i] = 0.0;
        for (go_integer k = 0; k < a->cols; ++k) {
            a->v[i] += a->el[i][k] * v[k];
        }
    }
    for (go_integer i = 0; i < a->rows; ++i) {
        to[i] = a->v[i];
    }
    return GO_RESULT_OK;
}
/* Each column of a 3 x N matrix, crossed with the vector. */
static inline int go_matrix_vector_cross(const go_matrix* a, const go_vector* v, go_matrix* to) {
    const go_cart w = {v[0], v[1], v[2]};
    if (!a->el || !to->el || a->rows != 3 || !__go_same_size(a, to)) return GO_RESULT_ERROR;
    for (go_integer j = 0; j < a->cols; ++j) {
        go_cart column = {a->el[0][j], a->el[1][j], a->el[2][j]};
        go_cart_cart_cross(&column, &w, &column);
        to->el[0][j] = column.x;
        to->el[1][j] = column.y;
        to->el[2][j] = column.z;
    }
    return GO_RESULT_OK;
}
static inline int go_matrix_transpose(const go_matrix* a, go_matrix* to) {
    if (!a->el || !to->el || to->rows != a->cols || to->cols != a->rows) return GO_RESULT_ERROR;
    for (go_integer i = 0; i < a->rows; ++i) {
        for (go_integer j = 0; j < a->cols; ++j) {
            to->elcpy[j][i] = a->el[i][j];
        }
    }
    for (go_integer i = 0; i < to->rows; ++i) {
        for (go_integer j = 0; j < to->cols; ++j) {
            to->el[i][j] = to->elcpy[i][j];
        }
    }
    return GO_RESULT_OK;
}
/* Gauss and Jordan with the largest pivot of each column; `rows` is used up. */
static inline int __go_invert(go_integer n, go_real* const* rows, go_real* const* to) {
    for (go_integer i = 0; i < n; ++i) {
        for (go_integer j = 0; j < n; ++j) {
            to[i][j] = i == j;
        }
    }
    for (go_integer c = 0; c < n; ++c) {
        go_integer pivot = c;
        for (go_integer i = c + 1; i < n; ++i) {
            if (fabs(rows[i][c]) > fabs(rows[pivot][c])) {
                pivot = i;
            }
        }
        const go_real by = rows[pivot][c];
        if (!(fabs(by) >= go_get_singular_epsilon())) return GO_RESULT_SINGULAR;
        for (go_integer j = 0; j < n; ++j) {
            const go_real a = rows[pivot][j];
            const go_real b = to[pivot][j];
            rows[pivot][j] = rows[c][j];
            to[pivot][j] = to[c][j];
            rows[c][j] = a / by;
            to[c][j] = b / by;
        }
        for (go_integer i = 0; i < n; ++i) {
            const go_real times = rows[i][c];
            if (i == c || times == 0.0) continue;
            for (go_integer j = 0; j < n; ++j) {
                rows[i][j] -= times * rows[c][j];
                to[i][j] -= times * to[c][j];
            }
        }
    }
    return GO_RESULT_OK;
}
static inline int go_matrix_inv(const go_matrix* a, go_matrix* to) {
    if (!a->el || !to->el || a->rows != a->cols || !__go_same_size(a, to)) return GO_RESULT_ERROR;
    for (go_integer i = 0; i < a->rows; ++i) {
        for (go_integer j = 0; j < a->cols; ++j) {
            a->elcpy[i][j] = a->el[i][j];
        }
    }
    return __go_invert(a->rows, a->elcpy, to->el);
}

#define __GO_SQUARE(n)                                                                        \
    static inline int go_mat##n##_inv(const go_real a[n][n], go_real to[n][n]) {              \
        go_real copy[n][n], *rows[n], *result[n];                                             \
        for (int i = 0; i < n; ++i) {                                                         \
            for (int j = 0; j < n; ++j)                                                       \
                copy[i][j] = a[i][j];                                                         \
            rows[i] = copy[i];                                                                \
            result[i] = to[i];                                                                \
        }                                                                                     \
        return __go_invert(n, rows, result);                                                  \
    }                                                                                         \
    static inline int go_mat##n##_mat##n##_mult(const go_real a[n][n], const go_real b[n][n], \
                                                go_real to[n][n]) {                           \
        go_real product[n][n];                                                                \
        for (int i = 0; i < n; ++i)                                                           \
            for (int j = 0; j < n; ++j) {                                                     \
                product[i][j] = 0.0;                                                          \
                for (int k = 0; k < n; ++k)                                                   \
                    product[i][j] += a[i][k] * b[k][j];                                       \
            }                                                                                 \
        for (int i = 0; i < n; ++i)                                                           \
            for (int j = 0; j < n; ++j)                                                       \
                to[i][j] = product[i][j];                                                     \
        return GO_RESULT_OK;                                                                  \
    }                                                                                         \
    static inline int go_mat##n##_vec##n##_mult(const go_real a[n][n], const go_real v[n],    \
                                                go_real to[n]) {                              \
        go_real product[n];                                                                   \
        for (int i = 0; i < n; ++i) {                                                         \
            product[i] = 0.0;                                                                 \
            for (int k = 0; k < n; ++k)                                                       \
                product[i] += a[i][k] * v[k];                                                 \
        }                                                                                     \
        for (int i = 0; i < n; ++i)                                                           \
            to[i] = product[i];                                                               \
        return GO_RESULT_OK;                                                                  \
    }
__GO_SQUARE(3)
__GO_SQUARE(4)
__GO_SQUARE(6)
#undef __GO_SQUARE

/* --- complex numbers, polynomials --- */

typedef struct {
    go_real re, im;
} go_complex;
typedef struct {
    go_real a, b;
} go_quadratic; /* x^2 + a x + b = 0 */

static inline go_complex go_complex_add(go_complex a, go_complex b) {
    return (go_complex){a.re + b.re, a.im + b.im};
}
static inline go_complex go_complex_sub(go_complex a, go_complex b) {
    return (go_complex){a.re - b.re, a.im - b.im};
}
static inline go_complex go_complex_mult(go_complex a, go_complex b) {
    return (go_complex){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
static inline go_complex go_complex_scale(go_complex a, go_real by) {
    return (go_complex){by * a.re, by * a.im};
}
static inline go_real go_complex_mag(go_complex a) { return hypot(a.re, a.im); }
static inline go_real go_complex_arg(go_complex a) { return atan2(a.im, a.re); }
static inline go_complex go_complex_div(go_complex a, go_complex b, int* result) {
    const go_real square = b.re * b.re + b.im * b.im;
    if (square < GO_REAL_MIN) {
        *result = GO_RESULT_DIV_ERROR;
        return (go_complex){0, 0};
    }
    *result = GO_RESULT_OK;

    return (go_complex){(a.re * b.re + a.im * b.im) / square, (a.im * b.re - a.re * b.im) / square};
}
static inline void go_complex_sqrt(go_complex a, go_complex* first, go_complex* second) {
    const go_real size = sqrt(go_complex_mag(a));
    const go_real half = go_complex_arg(a) / 2.0;
    *first = (go_complex){size * cos(half), size * sin(half)};
    *second = go_complex_scale(*first, -1.0);
}
static inline void go_complex_cbrt(go_complex a, go_complex* first, go_complex* second,
                                   go_complex* third) {
    const go_real size = cbrt(go_complex_mag(a));
    const go_real part = go_complex_arg(a) / 3.0;

    const go_real turn = 2.0 * 3.14159265358979323846 / 3.0;
    *first = (go_complex){size * cos(part), size * sin(part)};
    *second = (go_complex){size * cos(part + turn), size * sin(part + turn)};
    *third = (go_complex){size * cos(part - turn), size * sin(part - turn)};
}
/* The larger real root first from the sum, the other from the product, so that neither loses
 * digits. */
static inline int go_quadratic_solve(const go_quadratic* q, go_complex* first, go_complex* second) {
    const go_real half = -q->a / 2.0;
    const go_real square = half * half - q->b;
    if (square < 0.0) {
        *first = (go_complex){half, sqrt(-square)};
        *second = (go_complex){half, -sqrt(-square)};
        return GO_RESULT_OK;
    }
    const go_real far = half + (half < 0.0 ? -sqrt(square) : sqrt(square));

    const go_real near = far == 0.0 ? 0.0 : q->b / far;
    *first = (go_complex){far > near ? far : near, 0};
    *second = (go_complex){far > near ? near : far, 0};
    return GO_RESULT_OK;
}

#endif
