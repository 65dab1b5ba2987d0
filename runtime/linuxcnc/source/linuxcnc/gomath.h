/* SPDX-License-Identifier: MIT */
/* Vectors, rotations and poses of three dimensions, as plain C; included at the end:
 * gomath_geometry.h (lines, planes, links) and gomath_matrix.h (matrices, polynomials). Functions
 * return GO_RESULT_OK, or another result when a result does not exist (a unit vector of the length 0); those that
 * return go_flag return whether something is so, within GO_REAL_EPSILON. Results may be written
 * over arguments. Angles in rad. [any] */
#ifndef HALCYON_GOMATH_H
#define HALCYON_GOMATH_H

#include <math.h>

#include "gotypes.h"

#define GO_PI 3.14159265358979323846
#define GO_2_PI 6.28318530717958647692
#define GO_PI_2 1.57079632679489661923
#define GO_PI_4 0.78539816339744830962
#define GO_TO_DEG(rad) ((rad) * (180.0 / GO_PI))
#define GO_TO_RAD(deg) ((deg) * (GO_PI / 180.0))
#define GO_SMALL(x) (fabs(x) < GO_REAL_EPSILON)
#define GO_CLOSE(x, y) GO_SMALL((x) - (y))
#define GO_TRAN_SMALL(x) GO_SMALL(x)
#define GO_TRAN_CLOSE(x, y) GO_CLOSE(x, y)
#define GO_ROT_SMALL(x) GO_SMALL(x)
#define GO_ROT_CLOSE(x, y) GO_CLOSE(x, y)

static inline go_real go_sq(go_real x) { return x * x; }
static inline go_real go_cub(go_real x) { return x * x * x; }

typedef struct {
    go_real x, y, z;
} go_cart;
typedef struct {
    go_real theta, phi, r;
} go_sph; /* around z, down from z, length */
typedef struct {
    go_real theta, r, z;
} go_cyl;
typedef struct {
    go_real x, y, z;
} go_rvec; /* axis, as long as the angle */
typedef struct {
    go_cart x, y, z;
} go_mat; /* columns: where the axes go */
typedef struct {
    go_real s, x, y, z;
} go_quat; /* unit, s >= 0 */
typedef struct {
    go_real z, y, zp;
} go_zyz; /* about z, then the new y, then the new z */
typedef struct {
    go_real z, y, x;
} go_zyx; /* about z, then the new y, then the new x */
typedef struct {
    go_real r, p, y;
} go_rpy; /* about fixed x, then y, then z */
typedef struct {
    go_cart tran;
    go_quat rot;
} go_pose;
typedef struct {
    go_cart tran;
    go_mat rot;
} go_hom;
typedef struct {
    go_cart v, w;
} go_screw; /* linear and angular velocity */
typedef struct {
    go_cart point, direction;
} go_line; /* direction: unit */
typedef struct {
    go_cart normal;
    go_real d;
} go_plane; /* normal * p + d = 0, normal: unit */

static inline go_cart go_cart_zero(void) { return (go_cart){0, 0, 0}; }
static inline go_quat go_quat_identity(void) { return (go_quat){1, 0, 0, 0}; }
static inline go_pose go_pose_identity(void) { return (go_pose){{0, 0, 0}, {1, 0, 0, 0}}; }
static inline go_pose go_pose_this(go_real x, go_real y, go_real z, go_real rs, go_real rx,
                                   go_real ry, go_real rz) {
    return (go_pose){{x, y, z}, {rs, rx, ry, rz}};
}

/* --- vectors --- */

static inline go_real __go_dot(const go_cart* a, const go_cart* b) {
    return a->x * b->x + a->y * b->y + a->z * b->z;
}
/* `by` * v + w */
static inline go_cart __go_plus(const go_cart* w, go_real by, const go_cart* v) {
    return (go_cart){w->x + by * v->x, w->y + by * v->y, w->z + by * v->z};
}

static inline go_flag go_cart_cart_compare(const go_cart* a, const go_cart* b) {
    return GO_CLOSE(a->x, b->x) && GO_CLOSE(a->y, b->y) && GO_CLOSE(a->z, b->z);
}
static inline int go_cart_cart_dot(const go_cart* a, const go_cart* b, go_real* d) {
    *d = __go_dot(a, b);
    return GO_RESULT_OK;
}
static inline int go_cart_cart_cross(const go_cart* a, const go_cart* b, go_cart* to) {
    *to =
        (go_cart){a->y * b->z - a->z * b->y, a->z * b->x - a->x * b->z, a->x * b->y - a->y * b->x};

    return GO_RESULT_OK;
}
static inline int go_cart_magsq(const go_cart* v, go_real* d) {
    *d = __go_dot(v, v);
    return GO_RESULT_OK;
}
static inline int go_cart_mag(const go_cart* v, go_real* d) {
    *d = sqrt(__go_dot(v, v));
    return GO_RESULT_OK;
}
static inline int go_cart_cart_add(const go_cart* a, const go_cart* b, go_cart* to) {
    *to = __go_plus(a, 1.0, b);
    return GO_RESULT_OK;
}
static inline int go_cart_cart_sub(const go_cart* a, const go_cart* b, go_cart* to) {
    *to = __go_plus(a, -1.0, b);
    return GO_RESULT_OK;
}
static inline int go_cart_scale_mult(const go_cart* v, go_real by, go_cart* to) {
    *to = (go_cart){by * v->x, by * v->y, by * v->z};
    return GO_RESULT_OK;
}
static inline int go_cart_neg(const go_cart* v, go_cart* to) {
    return go_cart_scale_mult(v, -1.0, to);
}
static inline int go_cart_cart_disp(const go_cart* a, const go_cart* b, go_real* d) {
    const go_cart between = __go_plus(b, -1.0, a);
    return go_cart_mag(&between, d);
}
static inline int go_cart_unit(const go_cart* v, go_cart* to) {
    const go_real size = sqrt(__go_dot(v, v));
    if (size < GO_REAL_MIN) {
        *to = go_cart_zero();
        return GO_RESULT_NORM_ERROR;
    }
    return go_cart_scale_mult(v, 1.0 / size, to);
}
static inline go_flag go_cart_cart_perp(const go_cart* a, const go_cart* b) {
    return GO_SMALL(__go_dot(a, b));
}
static inline go_flag go_cart_cart_par(const go_cart* a, const go_cart* b) {
    go_cart cross, one, other;
    if (go_cart_unit(a, &one) || go_cart_unit(b, &other)) {
        return 1; /* nothing has no direction */
    }
    go_cart_cart_cross(&one, &other, &cross);
    return GO_SMALL(sqrt(__go_dot(&cross, &cross)));
}
/* The part of `v` along `base`, and the remainder in the plane of that normal. */
static inline int go_cart_cart_proj(const go_cart* v, const go_cart* base, go_cart* to) {
    const go_real square = __go_dot(base, base);
    if (square < GO_REAL_MIN) {
        *to = go_cart_zero();
        return GO_RESULT_DIV_ERROR;
    }
    return go_cart_scale_mult(base, __go_dot(v, base) / square, to);
}
static inline int go_cart_plane_proj(const go_cart* v, const go_cart* normal, go_cart* to) {
    go_cart along;
    const int result = go_cart_cart_proj(v, normal, &along);
    *to = __go_plus(v, -1.0, &along);
    return result;
}
static inline int go_cart_cart_angle(const go_cart* a, const go_cart* b, go_real* angle) {
    go_cart cross;
    go_cart_cart_cross(a, b, &cross);
    *angle = atan2(sqrt(__go_dot(&cross, &cross)),
                   __go_dot(a, b)); /* exact near 0 and pi, where an arc cosine is not */
    return GO_RESULT_OK;
}
/* A unit vector perpendicular to `v`: across the axis that `v` is farthest from. */
static inline int go_cart_normal(const go_cart* v, go_cart* to) {
    const go_real x = fabs(v->x);
    const go_real y = fabs(v->y);
    const go_real z = fabs(v->z);
    const go_cart axis = {x <= y && x <= z, y < x && y <= z, z < x && z < y};
    go_cart cross;
    go_cart_cart_cross(v, &axis, &cross);
    return go_cart_unit(&cross, to);
}
static inline int go_cart_centroid(const go_cart* points, go_integer count, go_cart* to) {
    go_cart sum = go_cart_zero();
    for (go_integer i = 0; i < count; ++i) {
        sum = __go_plus(&sum, 1.0, &points[i]);
    }
    return count < 1 ? (*to = sum, GO_RESULT_ERROR) : go_cart_scale_mult(&sum, 1.0 / count, to);
}
static inline int go_cart_centroidize(const go_cart* points, go_integer count, go_cart* centroid,
                                      go_cart* to) {
    const int result = go_cart_centroid(points, count, centroid);
    for (go_integer i = 0; i < count; ++i) {
        to[i] = __go_plus(&points[i], -1.0, centroid);
    }
    return result;
}
/* The points at these distances from three others: in their plane, and as far above as below it. */
static inline int go_cart_trilaterate(const go_cart* c1, const go_cart* c2, const go_cart* c3,
                                      go_real l1, go_real l2, go_real l3, go_cart* p1,
                                      go_cart* p2) {
    const go_cart to2 = __go_plus(c2, -1.0, c1);
    const go_cart to3 = __go_plus(c3, -1.0, c1);
    go_cart ex, ey, ez;
    if (go_cart_unit(&to2, &ex) || go_cart_plane_proj(&to3, &ex, &ey) || go_cart_unit(&ey, &ey)) {
        return GO_RESULT_ERROR;
    }
    go_cart_cart_cross(&ex, &ey, &ez);
    const go_real d = __go_dot(&to2, &ex);
    const go_real i = __go_dot(&to3, &ex);
    const go_real j = __go_dot(&to3, &ey);
    if (GO_SMALL(j)) return GO_RESULT_ERROR;
    const go_real x = (go_sq(l1) - go_sq(l2) + go_sq(d)) / (2.0 * d);
    const go_real y = (go_sq(l1) - go_sq(l3) + go_sq(i) + go_sq(j) - 2.0 * i * x) / (2.0 * j);

    const go_real square = go_sq(l1) - go_sq(x) - go_sq(y);
    if (square < -GO_REAL_EPSILON) return GO_RESULT_ERROR;
    const go_real z = square > 0.0 ? sqrt(square) : 0.0;
    const go_cart foot = __go_plus(c1, x, &ex);
    const go_cart middle = __go_plus(&foot, y, &ey);
    *p1 = __go_plus(&middle, z, &ez);
    *p2 = __go_plus(&middle, -z, &ez);
    return GO_RESULT_OK;
}

static inline int go_sph_cart_convert(const go_sph* s, go_cart* to) {
    *to = (go_cart){s->r * sin(s->phi) * cos(s->theta), s->r * sin(s->phi) * sin(s->theta),
                    s->r * cos(s->phi)};

    return GO_RESULT_OK;
}
static inline int go_cart_sph_convert(const go_cart* v, go_sph* to) {
    *to = (go_sph){atan2(v->y, v->x), atan2(hypot(v->x, v->y), v->z), sqrt(__go_dot(v, v))};

    return GO_RESULT_OK;
}
static inline int go_cyl_cart_convert(const go_cyl* c, go_cart* to) {
    *to = (go_cart){c->r * cos(c->theta), c->r * sin(c->theta), c->z};
    return GO_RESULT_OK;
}
static inline int go_cart_cyl_convert(const go_cart* v, go_cyl* to) {
    *to = (go_cyl){atan2(v->y, v->x), hypot(v->x, v->y), v->z};
    return GO_RESULT_OK;
}
static inline int go_sph_cyl_convert(const go_sph* s, go_cyl* to) {
    *to = (go_cyl){s->theta, s->r * sin(s->phi), s->r * cos(s->phi)};
    return GO_RESULT_OK;
}
static inline int go_cyl_sph_convert(const go_cyl* c, go_sph* to) {
    *to = (go_sph){c->theta, atan2(c->r, c->z), hypot(c->r, c->z)};
    return GO_RESULT_OK;
}
static inline int go_cart_rvec_convert(const go_cart* v, go_rvec* to) {
    *to = (go_rvec){v->x, v->y, v->z};
    return GO_RESULT_OK;
}
static inline int go_rvec_cart_convert(const go_rvec* v, go_cart* to) {
    *to = (go_cart){v->x, v->y, v->z};
    return GO_RESULT_OK;
}

/* --- quaternions --- */

static inline go_flag go_quat_is_norm(const go_quat* q) {
    return GO_CLOSE(go_sq(q->s) + go_sq(q->x) + go_sq(q->y) + go_sq(q->z), 1.0);
}
static inline int go_quat_norm(const go_quat* q, go_quat* to) {
    const go_real size = sqrt(go_sq(q->s) + go_sq(q->x) + go_sq(q->y) + go_sq(q->z));

    const go_real by = q->s < 0.0 ? -size : size;
    if (size < GO_REAL_MIN) {
        *to = go_quat_identity();
        return GO_RESULT_NORM_ERROR;
    }
    *to = (go_quat){q->s / by, q->x / by, q->y / by, q->z / by};
    return GO_RESULT_OK;
}
static inline int go_quat_inv(const go_quat* q, go_quat* to) {
    *to = (go_quat){q->s, -q->x, -q->y, -q->z};
    return GO_RESULT_OK;
}
/* `b` first, then `a`. */
static inline int go_quat_quat_mult(const go_quat* a, const go_quat* b, go_quat* to) {
    const go_cart u = {a->x, a->y, a->z};
    const go_cart v = {b->x, b->y, b->z};
    const go_real s = a->s * b->s - __go_dot(&u, &v);
    const go_real sign = s < 0.0 ? -1.0 : 1.0;
    go_cart cross;
    go_cart_cart_cross(&u, &v, &cross);
    cross = __go_plus(&cross, a->s, &v);
    cross = __go_plus(&cross, b->s, &u);
    *to = (go_quat){sign * s, sign * cross.x, sign * cross.y, sign * cross.z};
    return GO_RESULT_OK;
}
static inline int go_quat_cart_mult(const go_quat* q, const go_cart* v, go_cart* to) {
    const go_cart u = {q->x, q->y, q->z};
    go_cart once, twice;
    go_cart_cart_cross(&u, v, &once);
    go_cart_cart_cross(&u, &once, &twice);
    const go_cart turned = __go_plus(v, 2.0 * q->s, &once);
    *to = __go_plus(&turned, 2.0, &twice);
    return GO_RESULT_OK;
}
static inline int go_rvec_quat_convert(const go_rvec* r, go_quat* to) {
    const go_real angle = sqrt(go_sq(r->x) + go_sq(r->y) + go_sq(r->z));

    const go_real by = angle < GO_REAL_MIN ? 0.5 : sin(angle / 2.0) / angle;
    const go_quat q = {cos(angle / 2.0), by * r->x, by * r->y, by * r->z};
    return go_quat_norm(&q, to);
}
static inline int go_quat_rvec_convert(const go_quat* q, go_rvec* to) {
    const go_real sine = sqrt(go_sq(q->x) + go_sq(q->y) + go_sq(q->z));

    const go_real by = sine < GO_REAL_MIN ? 2.0 : 2.0 * atan2(sine, q->s) / sine;
    *to = (go_rvec){by * q->x, by * q->y, by * q->z};
    return GO_RESULT_OK;
}
/* The same axis, `by` times the angle. */
static inline int go_rvec_scale_mult(const go_rvec* r, go_real by, go_rvec* to) {
    *to = (go_rvec){by * r->x, by * r->y, by * r->z};
    return GO_RESULT_OK;
}
static inline int go_quat_scale_mult(const go_quat* q, go_real by, go_quat* to) {
    go_rvec r;
    go_quat_rvec_convert(q, &r);
    go_rvec_scale_mult(&r, by, &r);
    return go_rvec_quat_convert(&r, to);
}
/* The angle, and a rotation by 1 rad about the same axis. */
static inline int go_quat_mag(const go_quat* q, go_real* d) {
    *d = 2.0 * atan2(sqrt(go_sq(q->x) + go_sq(q->y) + go_sq(q->z)), q->s);
    return GO_RESULT_OK;
}
static inline int go_quat_unit(const go_quat* q, go_quat* to) {
    go_real angle;
    go_quat_mag(q, &angle);
    return GO_SMALL(angle) ? GO_RESULT_NORM_ERROR : go_quat_scale_mult(q, 1.0 / angle, to);
}
/* The same rotation: q and -q are. */
static inline go_flag go_quat_quat_compare(const go_quat* a, const go_quat* b) {
    const go_real sign = a->s * b->s + a->x * b->x + a->y * b->y + a->z * b->z < 0.0 ? -1.0 : 1.0;
    return GO_CLOSE(a->s, sign * b->s) && GO_CLOSE(a->x, sign * b->x) &&
           GO_CLOSE(a->y, sign * b->y) && GO_CLOSE(a->z, sign * b->z);
}
static inline go_flag go_rvec_rvec_compare(const go_rvec* a, const go_rvec* b) {
    go_quat p, q;
    go_rvec_quat_convert(a, &p);
    go_rvec_quat_convert(b, &q);
    return go_quat_quat_compare(&p, &q);
}
/* The smallest rotation that turns `a` to `b`: half way between no rotation and twice it. */
static inline int go_cart_cart_rot(const go_cart* a, const go_cart* b, go_quat* to) {
    go_cart one, other, axis;
    if (go_cart_unit(a, &one) || go_cart_unit(b, &other)) {
        *to = go_quat_identity();
        return GO_RESULT_NORM_ERROR;
    }
    const go_real cosine = __go_dot(&one, &other);
    if (cosine < -1.0 + 1e-15) { /* opposite: half a turn about any normal */
        go_cart_normal(&one, &axis);
        *to = (go_quat){0, axis.x, axis.y, axis.z};
        return GO_RESULT_OK;
    }
    go_cart_cart_cross(&one, &other, &axis);
    const go_quat q = {1.0 + cosine, axis.x, axis.y, axis.z};
    return go_quat_norm(&q, to);
}

/* --- rotation matrices --- */

static inline int go_mat_cart_mult(const go_mat* m, const go_cart* v, go_cart* to) {
    go_cart sum = {v->x * m->x.x, v->x * m->x.y, v->x * m->x.z};
    sum = __go_plus(&sum, v->y, &m->y);
    *to = __go_plus(&sum, v->z, &m->z);
    return GO_RESULT_OK;
}
static inline int go_mat_mat_mult(const go_mat* a, const go_mat* b, go_mat* to) {
    go_mat m;
    go_mat_cart_mult(a, &b->x, &m.x);
    go_mat_cart_mult(a, &b->y, &m.y);
    go_mat_cart_mult(a, &b->z, &m.z);
    *to = m;
    return GO_RESULT_OK;
}
static inline int go_mat_inv(const go_mat* m, go_mat* to) {
    *to = (go_mat){{m->x.x, m->y.x, m->z.x}, {m->x.y, m->y.y, m->z.y}, {m->x.z, m->y.z, m->z.z}};

    return GO_RESULT_OK;
}
static inline go_flag go_mat_is_norm(const go_mat* m) {
    go_cart z;
    go_cart_cart_cross(&m->x, &m->y, &z);
    return GO_CLOSE(__go_dot(&m->x, &m->x), 1.0) && GO_CLOSE(__go_dot(&m->y, &m->y), 1.0) &&
           go_cart_cart_compare(&z, &m->z);
}
/* x keeps its direction, y its plane with x. */
static inline int go_mat_norm(const go_mat* m, go_mat* to) {
    go_mat n;
    if (go_cart_unit(&m->x, &n.x) || go_cart_plane_proj(&m->y, &n.x, &n.y) ||
        go_cart_unit(&n.y, &n.y)) {
        return GO_RESULT_NORM_ERROR;
    }
    go_cart_cart_cross(&n.x, &n.y, &n.z);
    *to = n;
    return GO_RESULT_OK;
}
static inline int go_quat_mat_convert(const go_quat* q, go_mat* to) {
    const go_cart x = {1, 0, 0};
    const go_cart y = {0, 1, 0};
    const go_cart z = {0, 0, 1};
    go_mat m;
    go_quat_cart_mult(q, &x, &m.x);
    go_quat_cart_mult(q, &y, &m.y);
    go_quat_cart_mult(q, &z, &m.z);
    *to = m;
    return GO_RESULT_OK;
}
/* From the largest of four squares, since the others divide by its root. */
static inline int go_mat_quat_convert(const go_mat* m, go_quat* to) {
    const go_real s = 1.0 + m->x.x + m->y.y + m->z.z;
    const go_real x = 1.0 + m->x.x - m->y.y - m->z.z;

    const go_real y = 1.0 - m->x.x + m->y.y - m->z.z;
    const go_real z = 1.0 - m->x.x - m->y.y + m->z.z;
    const go_real yz = m->y.z - m->z.y;
    const go_real zx = m->z.x - m->x.z;
    const go_real xy = m->x.y - m->y.x;
    go_quat q;
    if (!go_mat_is_norm(m)) {
        *to = go_quat_identity();
        return GO_RESULT_NORM_ERROR;
    }
    if (s >= x && s >= y && s >= z) {
        q = (go_quat){s, yz, zx, xy};
    } else if (x >= y && x >= z) {
        q = (go_quat){yz, x, m->x.y + m->y.x, m->x.z + m->z.x};
    } else if (y >= z) {
        q = (go_quat){zx, m->x.y + m->y.x, y, m->y.z + m->z.y};
    } else {
        q = (go_quat){xy, m->x.z + m->z.x, m->y.z + m->z.y, z};
    }
    return go_quat_norm(&q, to);
}

/* Angles: rotations about an axis of the frame so far, in turn. */
static inline go_quat __go_about(int axis, go_real angle) {
    go_real sines[3] = {0.0, 0.0, 0.0};
    sines[axis] = sin(angle / 2.0);
    return (go_quat){cos(angle / 2.0), sines[0], sines[1], sines[2]};
}
static inline int __go_in_turn(int a, go_real first, int b, go_real second, int c, go_real third,
                               go_quat* to) {
    const go_quat one = __go_about(a, first);
    const go_quat two = __go_about(b, second);

    const go_quat three = __go_about(c, third);
    go_quat both;
    go_quat_quat_mult(&one, &two, &both);
    go_quat_quat_mult(&both, &three, &both);
    return go_quat_norm(&both, to);
}
static inline int go_zyz_quat_convert(const go_zyz* a, go_quat* to) {
    return __go_in_turn(2, a->z, 1, a->y, 2, a->zp, to);
}
static inline int go_zyx_quat_convert(const go_zyx* a, go_quat* to) {
    return __go_in_turn(2, a->z, 1, a->y, 0, a->x, to);
}
static inline int go_rpy_quat_convert(const go_rpy* a, go_quat* to) {
    return __go_in_turn(2, a->y, 1, a->p, 0, a->r, to);
}
/* Where the middle angle is 0 or a half turn the first and the third are one rotation: all of it is
 * given as the first. */
static inline int go_mat_zyz_convert(const go_mat* m, go_zyz* to) {
    const go_real level = hypot(m->z.x, m->z.y);
    const go_real y = atan2(level, m->z.z);
    if (level < GO_REAL_EPSILON) {
        *to = (go_zyz){m->z.z > 0.0 ? atan2(m->x.y, m->x.x) : atan2(-m->x.y, -m->x.x), y, 0.0};

        return GO_RESULT_OK;
    }
    *to = (go_zyz){atan2(m->z.y, m->z.x), y, atan2(m->y.z, -m->x.z)};
    return GO_RESULT_OK;
}
/* The same at a quarter turn, up or down. */
static inline int go_mat_zyx_convert(const go_mat* m, go_zyx* to) {
    const go_real level = hypot(m->x.x, m->x.y);
    const go_real y = atan2(-m->x.z, level);
    if (level < GO_REAL_EPSILON) {
        *to = (go_zyx){atan2(-m->y.x, m->y.y), y, 0.0};
        return GO_RESULT_OK;
    }
    *to = (go_zyx){atan2(m->x.y, m->x.x), y, atan2(m->y.z, m->z.z)};
    return GO_RESULT_OK;
}
static inline int go_mat_rpy_convert(const go_mat* m, go_rpy* to) {
    go_zyx a;
    const int result = go_mat_zyx_convert(m, &a);
    *to = (go_rpy){a.x, a.y, a.z};
    return result;
}

/* Every other pair of rotations goes through a quaternion or a matrix. */
#define __GO_THROUGH(from, middle, last)                                                       \
    static inline int go_##from##_##last##_convert(const go_##from* a, go_##last* to) {        \
        go_##middle between;                                                                   \
        const int result = go_##from##_##middle##_convert(a, &between);                        \
        return result != GO_RESULT_OK ? result : go_##middle##_##last##_convert(&between, to); \
    }
__GO_THROUGH(rvec, quat, mat)
__GO_THROUGH(zyz, quat, mat)
__GO_THROUGH(zyx, quat, mat)
__GO_THROUGH(rpy, quat, mat)
__GO_THROUGH(quat, mat, zyz)
__GO_THROUGH(quat, mat, zyx)
__GO_THROUGH(quat, mat, rpy)
__GO_THROUGH(rvec, mat, zyz)
__GO_THROUGH(rvec, mat, zyx)
__GO_THROUGH(rvec, mat, rpy)
__GO_THROUGH(mat, quat, rvec)
__GO_THROUGH(zyz, quat, rvec)
__GO_THROUGH(zyz, mat, zyx)
__GO_THROUGH(zyz, mat, rpy)
__GO_THROUGH(zyx, quat, rvec)
__GO_THROUGH(zyx, mat, zyz)
__GO_THROUGH(zyx, mat, rpy)
__GO_THROUGH(rpy, quat, rvec)
__GO_THROUGH(rpy, mat, zyz)
__GO_THROUGH(rpy, mat, zyx)
#undef __GO_THROUGH

/* --- poses --- */

static inline go_flag go_pose_pose_compare(const go_pose* a, const go_pose* b) {
    return go_cart_cart_compare(&a->tran, &b->tran) && go_quat_quat_compare(&a->rot, &b->rot);
}
static inline int go_pose_cart_mult(const go_pose* p, const go_cart* v, go_cart* to) {
    go_cart turned;
    go_quat_cart_mult(&p->rot, v, &turned);
    return go_cart_cart_add(&p->tran, &turned, to);
}
static inline int go_pose_pose_mult(const go_pose* a, const go_pose* b, go_pose* to) {
    go_pose p;
    go_pose_cart_mult(a, &b->tran, &p.tran);
    go_quat_quat_mult(&a->rot, &b->rot, &p.rot);
    *to = p;
    return GO_RESULT_OK;
}
static inline int go_pose_inv(const go_pose* p, go_pose* to) {
    go_pose inverse;
    go_quat_inv(&p->rot, &inverse.rot);
    go_quat_cart_mult(&inverse.rot, &p->tran, &inverse.tran);
    go_cart_neg(&inverse.tran, &inverse.tran);
    *to = inverse;
    return GO_RESULT_OK;
}
static inline int go_pose_scale_mult(const go_pose* p, go_real by, go_pose* to) {
    go_cart_scale_mult(&p->tran, by, &to->tran);
    return go_quat_scale_mult(&p->rot, by, &to->rot);
}
/* At t1 it is p1, at t2 p2: on a straight line and about one axis, each at constant speed. */
static inline int go_pose_pose_interp(go_real t1, const go_pose* p1, go_real t2, const go_pose* p2,
                                      go_real t3, go_pose* to) {
    if (GO_SMALL(t2 - t1)) return GO_RESULT_DIV_ERROR;
    const go_real part = (t3 - t1) / (t2 - t1);
    const go_cart way = __go_plus(&p2->tran, -1.0, &p1->tran);

    const go_cart tran = __go_plus(&p1->tran, part, &way);
    go_quat back, turn;
    go_quat_inv(&p1->rot, &back);
    go_quat_quat_mult(&back, &p2->rot, &turn);
    go_quat_scale_mult(&turn, part, &turn);
    go_quat_quat_mult(&p1->rot, &turn, &to->rot);
    to->tran = tran;
    return GO_RESULT_OK;
}
static inline int go_pose_hom_convert(const go_pose* p, go_hom* to) {
    to->tran = p->tran;
    return go_quat_mat_convert(&p->rot, &to->rot);
}
static inline int go_hom_pose_convert(const go_hom* h, go_pose* to) {
    to->tran = h->tran;
    return go_mat_quat_convert(&h->rot, &to->rot);
}
static inline int go_hom_inv(const go_hom* h, go_hom* to) {
    go_hom inverse;
    go_mat_inv(&h->rot, &inverse.rot);
    go_mat_cart_mult(&inverse.rot, &h->tran, &inverse.tran);
    go_cart_neg(&inverse.tran, &inverse.tran);
    *to = inverse;
    return GO_RESULT_OK;
}

#include "gomath_geometry.h"
#include "gomath_matrix.h"

#endif
