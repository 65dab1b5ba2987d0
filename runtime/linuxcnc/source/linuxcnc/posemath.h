/* SPDX-License-Identifier: MIT */
/* Vectors, rotations and poses of three dimensions, as plain C. Functions return 0, or -1 when the
 * result does not exist (a unit vector of the length 0, a division by 0); results may be written over
 * arguments. Angles in rad. [any] */
#ifndef HALCYON_POSEMATH_H
#define HALCYON_POSEMATH_H

#include <math.h>

typedef struct {
    double x, y, z;
} PmCartesian;
typedef struct {
    double theta, phi, r;
} PmSpherical; /* around z, from z, length */
typedef struct {
    double theta, r, z;
} PmCylindrical;
typedef struct {
    double s, x, y, z;
} PmRotationVector; /* angle, and a unit axis */
typedef struct {
    PmCartesian x, y, z;
} PmRotationMatrix; /* columns: where the axes go */
typedef struct {
    double s, x, y, z;
} PmQuaternion; /* unit, s >= 0 */
typedef struct {
    double r, p, y;
} PmRpy; /* about fixed x, then y, then z */
typedef struct {
    double z, y, zp;
} PmEulerZyz; /* about z, then the new y, then the new z */
typedef struct {
    double z, y, x;
} PmEulerZyx; /* about z, then the new y, then the new x */
typedef enum { PM_X, PM_Y, PM_Z } PmAxis;
typedef struct {
    PmCartesian tran;
    PmQuaternion rot;
} PmPose;
typedef struct {
    PmCartesian tran;
    PmRotationMatrix rot;
} PmHomogeneous;

#define PM_PI 3.14159265358979323846
#define PM_PI_2 1.57079632679489661923
#define PM_PI_4 0.78539816339744830962
#define PM_2_PI 6.28318530717958647692
#define TO_DEG (180.0 / PM_PI)
#define TO_RAD (PM_PI / 180.0)
#define pmSq(x) ((x) * (x))
#define pmClose(a, b, within) (fabs((a) - (b)) < (within))
#define PM_ERR (-1)
#define PM_IMPL_ERR (-2)
#define PM_NORM_ERR (-3)
#define PM_DIV_ERR (-4)

static inline int __pm_vector(PmCartesian* to, double x, double y, double z) {
    to->x = x;
    to->y = y;
    to->z = z;
    return isfinite(x) && isfinite(y) && isfinite(z) ? 0 : -1;
}
static inline double __pm_dot(const PmCartesian* a, const PmCartesian* b) {
    return a->x * b->x + a->y * b->y + a->z * b->z;
}

static inline double pmSqrt(double x) { return x > 0.0 ? sqrt(x) : 0.0; }

/* --- vectors --- */

static inline int pmCartCartCompare(const PmCartesian* a, const PmCartesian* b) {
    return fabs(a->x - b->x) < 1e-6 && fabs(a->y - b->y) < 1e-6 && fabs(a->z - b->z) < 1e-6;
}
static inline int pmCartCartDot(const PmCartesian* a, const PmCartesian* b, double* d) {
    *d = __pm_dot(a, b);
    return 0;
}
static inline int pmCartCartMult(const PmCartesian* a, const PmCartesian* b, PmCartesian* to) {
    return __pm_vector(to, a->x * b->x, a->y * b->y, a->z * b->z);
}
static inline int pmCartCartCross(const PmCartesian* a, const PmCartesian* b, PmCartesian* to) {
    return __pm_vector(to, a->y * b->z - a->z * b->y, a->z * b->x - a->x * b->z,
                       a->x * b->y - a->y * b->x);
}
static inline int pmCartMag(const PmCartesian* v, double* d) {
    *d = sqrt(__pm_dot(v, v));
    return 0;
}
static inline int pmCartMagSq(const PmCartesian* v, double* d) {
    *d = __pm_dot(v, v);
    return 0;
}
static inline int pmCartCartAdd(const PmCartesian* a, const PmCartesian* b, PmCartesian* to) {
    return __pm_vector(to, a->x + b->x, a->y + b->y, a->z + b->z);
}
static inline int pmCartCartSub(const PmCartesian* a, const PmCartesian* b, PmCartesian* to) {
    return __pm_vector(to, a->x - b->x, a->y - b->y, a->z - b->z);
}
static inline int pmCartCartDisp(const PmCartesian* a, const PmCartesian* b, double* d) {
    PmCartesian between;
    pmCartCartSub(b, a, &between);
    return pmCartMag(&between, d);
}
static inline int pmCartScalMult(const PmCartesian* v, double d, PmCartesian* to) {
    return __pm_vector(to, v->x * d, v->y * d, v->z * d);
}
static inline int pmCartScalDiv(const PmCartesian* v, double d, PmCartesian* to) {
    return d == 0.0 ? __pm_vector(to, 0.0, 0.0, 0.0),
           -1       : __pm_vector(to, v->x / d, v->y / d, v->z / d);
}
static inline int pmCartNeg(const PmCartesian* v, PmCartesian* to) {
    return __pm_vector(to, -v->x, -v->y, -v->z);
}
static inline int pmCartInv(const PmCartesian* v, PmCartesian* to) {
    return pmCartScalDiv(v, __pm_dot(v, v), to);
}
static inline int pmCartUnit(const PmCartesian* v, PmCartesian* to) {
    return pmCartScalDiv(v, sqrt(__pm_dot(v, v)), to);
}
static inline int pmCartAddEq(PmCartesian* v, const PmCartesian* other) {
    return pmCartCartAdd(v, other, v);
}
static inline int pmCartSubEq(PmCartesian* v, const PmCartesian* other) {
    return pmCartCartSub(v, other, v);
}
static inline int pmCartScalMultEq(PmCartesian* v, double d) { return pmCartScalMult(v, d, v); }
static inline int pmCartScalDivEq(PmCartesian* v, double d) { return pmCartScalDiv(v, d, v); }
static inline int pmCartNegEq(PmCartesian* v) { return pmCartNeg(v, v); }
static inline int pmCartUnitEq(PmCartesian* v) { return pmCartUnit(v, v); }
/* The part of `v` along `base`. */
static inline int pmCartCartProj(const PmCartesian* v, const PmCartesian* base, PmCartesian* to) {
    const double square = __pm_dot(base, base);
    return square == 0.0 ? __pm_vector(to, 0.0, 0.0, 0.0),
           -1            : pmCartScalMult(base, __pm_dot(v, base) / square, to);
}
/* The component of `v` in the plane with this normal. */
static inline int pmCartPlaneProj(const PmCartesian* v, const PmCartesian* normal,
                                  PmCartesian* to) {
    PmCartesian along;
    const int result = pmCartCartProj(v, normal, &along);
    pmCartCartSub(v, &along, to);
    return result;
}
static inline int pmCartIsNorm(const PmCartesian* v) { return pmClose(__pm_dot(v, v), 1.0, 1e-6); }

static inline int pmSphCartConvert(const PmSpherical* s, PmCartesian* to) {
    return __pm_vector(to, s->r * sin(s->phi) * cos(s->theta), s->r * sin(s->phi) * sin(s->theta),
                       s->r * cos(s->phi));
}
static inline int pmCartSphConvert(const PmCartesian* v, PmSpherical* to) {
    const double r = sqrt(__pm_dot(v, v));
    *to = (PmSpherical){atan2(v->y, v->x), atan2(hypot(v->x, v->y), v->z), r};
    return 0;
}
static inline int pmCylCartConvert(const PmCylindrical* c, PmCartesian* to) {
    return __pm_vector(to, c->r * cos(c->theta), c->r * sin(c->theta), c->z);
}
static inline int pmCartCylConvert(const PmCartesian* v, PmCylindrical* to) {
    *to = (PmCylindrical){atan2(v->y, v->x), hypot(v->x, v->y), v->z};
    return 0;
}
static inline int pmSphCylConvert(const PmSpherical* s, PmCylindrical* to) {
    *to = (PmCylindrical){s->theta, s->r * sin(s->phi), s->r * cos(s->phi)};
    return 0;
}
static inline int pmCylSphConvert(const PmCylindrical* c, PmSpherical* to) {
    *to = (PmSpherical){c->theta, atan2(c->r, c->z), hypot(c->r, c->z)};
    return 0;
}

/* --- rotations --- */

static inline int pmQuatNorm(const PmQuaternion* q, PmQuaternion* to) {
    const double size = sqrt(q->s * q->s + q->x * q->x + q->y * q->y + q->z * q->z);

    const double by = q->s < 0.0 ? -size : size;
    if (size == 0.0) {
        *to = (PmQuaternion){1.0, 0.0, 0.0, 0.0};
        return -1;
    }
    *to = (PmQuaternion){q->s / by, q->x / by, q->y / by, q->z / by};
    return 0;
}
static inline int pmQuatInv(const PmQuaternion* q, PmQuaternion* to) {
    *to = (PmQuaternion){q->s, -q->x, -q->y, -q->z};
    return 0;
}
static inline int pmQuatIsNorm(const PmQuaternion* q) {
    return fabs(q->s * q->s + q->x * q->x + q->y * q->y + q->z * q->z - 1.0) < 1e-6;
}
static inline int pmQuatMag(const PmQuaternion* q, double* d) {
    *d = 2.0 * atan2(sqrt(q->x * q->x + q->y * q->y + q->z * q->z), q->s);
    return 0;
}
/* The same rotation: q and -q are. */
static inline int pmQuatQuatCompare(const PmQuaternion* a, const PmQuaternion* b) {
    const double sign = a->s * b->s + a->x * b->x + a->y * b->y + a->z * b->z < 0.0 ? -1.0 : 1.0;
    return pmClose(a->s, sign * b->s, 1e-6) && pmClose(a->x, sign * b->x, 1e-6) &&
           pmClose(a->y, sign * b->y, 1e-6) && pmClose(a->z, sign * b->z, 1e-6);
}
/* `b` first, then `a`. */
static inline int pmQuatQuatMult(const PmQuaternion* a, const PmQuaternion* b, PmQuaternion* to) {
    const PmQuaternion q = {a->s * b->s - a->x * b->x - a->y * b->y - a->z * b->z,
                            a->s * b->x + a->x * b->s + a->y * b->z - a->z * b->y,
                            a->s * b->y - a->x * b->z + a->y * b->s + a->z * b->x,
                            a->s * b->z + a->x * b->y - a->y * b->x + a->z * b->s};
    const double sign = q.s < 0.0 ? -1.0 : 1.0;
    *to = (PmQuaternion){sign * q.s, sign * q.x, sign * q.y, sign * q.z};
    return 0;
}
static inline int pmQuatCartMult(const PmQuaternion* q, const PmCartesian* v, PmCartesian* to) {
    const PmCartesian u = {q->x, q->y, q->z};
    PmCartesian once, twice;
    pmCartCartCross(&u, v, &once);
    pmCartCartCross(&u, &once, &twice);
    return __pm_vector(to, v->x + 2.0 * (q->s * once.x + twice.x),
                       v->y + 2.0 * (q->s * once.y + twice.y),
                       v->z + 2.0 * (q->s * once.z + twice.z));
}
static inline int pmRotQuatConvert(const PmRotationVector* r, PmQuaternion* to) {
    const double size = sqrt(r->x * r->x + r->y * r->y + r->z * r->z);

    const double sine = size == 0.0 ? 0.0 : sin(r->s / 2.0) / size;
    const PmQuaternion q = {cos(r->s / 2.0), sine * r->x, sine * r->y, sine * r->z};
    if (size == 0.0 && r->s != 0.0) {
        *to = (PmQuaternion){1.0, 0.0, 0.0, 0.0};
        return -1;
    }
    return pmQuatNorm(&q, to);
}
static inline int pmQuatRotConvert(const PmQuaternion* q, PmRotationVector* to) {
    const double sine = sqrt(q->x * q->x + q->y * q->y + q->z * q->z);
    if (sine < 1e-15) {
        *to = (PmRotationVector){0.0, 1.0, 0.0, 0.0};
        return 0;
    }
    *to = (PmRotationVector){2.0 * atan2(sine, q->s), q->x / sine, q->y / sine, q->z / sine};

    return 0;
}
static inline int pmRotIsNorm(const PmRotationVector* r) {
    return pmClose(r->s, 0.0, 1e-6) || pmClose(r->x * r->x + r->y * r->y + r->z * r->z, 1.0, 1e-6);
}
static inline int pmRotNorm(const PmRotationVector* r, PmRotationVector* to) {
    const double size = sqrt(r->x * r->x + r->y * r->y + r->z * r->z);
    if (size == 0.0) {
        *to = (PmRotationVector){0.0, 1.0, 0.0, 0.0};
        return PM_NORM_ERR;
    }
    *to = (PmRotationVector){r->s, r->x / size, r->y / size, r->z / size};
    return 0;
}
/* The same axis, `by` times the angle. */
static inline int pmRotScalMult(const PmRotationVector* r, double by, PmRotationVector* to) {
    *to = (PmRotationVector){by * r->s, r->x, r->y, r->z};
    return 0;
}
static inline int pmRotScalDiv(const PmRotationVector* r, double by, PmRotationVector* to) {
    return by == 0.0 ? *to = *r, PM_DIV_ERR : pmRotScalMult(r, 1.0 / by, to);
}
static inline int pmQuatScalMult(const PmQuaternion* q, double by, PmQuaternion* to) {
    PmRotationVector r;
    pmQuatRotConvert(q, &r);
    r.s *= by;
    return pmRotQuatConvert(&r, to);
}
static inline int pmQuatScalDiv(const PmQuaternion* q, double by, PmQuaternion* to) {
    return by == 0.0 ? *to = *q, PM_DIV_ERR : pmQuatScalMult(q, 1.0 / by, to);
}
static inline int pmAxisAngleQuatConvert(PmAxis axis, double angle, PmQuaternion* to) {
    const double sine = sin(angle / 2.0);
    PmQuaternion q = {cos(angle / 2.0), 0.0, 0.0, 0.0};
    switch (axis) {
    case PM_X: q.x = sine; break;
    case PM_Y: q.y = sine; break;
    case PM_Z: q.z = sine; break;
    }
    return pmQuatNorm(&q, to);
}
static inline int pmQuatAxisAngleMult(const PmQuaternion* q, PmAxis axis, double angle,
                                      PmQuaternion* to) {
    PmQuaternion turn;
    pmAxisAngleQuatConvert(axis, angle, &turn);
    return pmQuatQuatMult(q, &turn, to);
}
static inline int pmQuatMatConvert(const PmQuaternion* q, PmRotationMatrix* to) {
    const PmCartesian x = {1.0, 0.0, 0.0};
    const PmCartesian y = {0.0, 1.0, 0.0};
    const PmCartesian z = {0.0, 0.0, 1.0};
    PmRotationMatrix m;
    pmQuatCartMult(q, &x, &m.x);
    pmQuatCartMult(q, &y, &m.y);
    pmQuatCartMult(q, &z, &m.z);
    *to = m;
    return 0;
}
static inline int pmMatQuatConvert(const PmRotationMatrix* m, PmQuaternion* to) {
    /* From the largest of the four squares: the others divide by its root. */
    const double four[4] = {1.0 + m->x.x + m->y.y + m->z.z, 1.0 + m->x.x - m->y.y - m->z.z,
                            1.0 - m->x.x + m->y.y - m->z.z, 1.0 - m->x.x - m->y.y + m->z.z};
    const double yz = m->y.z - m->z.y;
    const double zx = m->z.x - m->x.z;
    const double xy = m->x.y - m->y.x;
    PmQuaternion q;
    int max = 0;
    for (int i = 1; i < 4; ++i) {
        if (four[i] > four[max]) {
            max = i;
        }
    }
    switch (max) {
    case 0: q = (PmQuaternion){four[0], yz, zx, xy}; break;
    case 1: q = (PmQuaternion){yz, four[1], m->x.y + m->y.x, m->x.z + m->z.x}; break;
    case 2: q = (PmQuaternion){zx, m->x.y + m->y.x, four[2], m->y.z + m->z.y}; break;
    default: q = (PmQuaternion){xy, m->x.z + m->z.x, m->y.z + m->z.y, four[3]}; break;
    }
    return pmQuatNorm(&q, to);
}
static inline int pmRpyMatConvert(const PmRpy* a, PmRotationMatrix* to) {
    const double sr = sin(a->r);
    const double cr = cos(a->r);
    const double sp = sin(a->p);
    const double cp = cos(a->p);
    const double sy = sin(a->y);

    const double cy = cos(a->y);
    to->x = (PmCartesian){cp * cy, cp * sy, -sp};
    to->y = (PmCartesian){sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp};
    to->z = (PmCartesian){cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp};
    return 0;
}
static inline int pmMatRpyConvert(const PmRotationMatrix* m, PmRpy* to) {
    const double level = hypot(m->x.x, m->x.y);
    to->p = atan2(-m->x.z, level);
    if (level < 1e-6) { /* straight up or down, where roll and yaw are the same turn */
        to->r = to->p > 0.0 ? atan2(m->y.x, m->y.y) : -atan2(m->y.x, m->y.y);
        to->y = 0.0;
        return 0;
    }
    to->r = atan2(m->y.z, m->z.z);
    to->y = atan2(m->x.y, m->x.x);
    return 0;
}
static inline int pmRpyQuatConvert(const PmRpy* a, PmQuaternion* to) {
    PmRotationMatrix m;
    pmRpyMatConvert(a, &m);
    return pmMatQuatConvert(&m, to);
}
static inline int pmQuatRpyConvert(const PmQuaternion* q, PmRpy* to) {
    PmRotationMatrix m;
    pmQuatMatConvert(q, &m);
    return pmMatRpyConvert(&m, to);
}
static inline int pmZyzQuatConvert(const PmEulerZyz* a, PmQuaternion* to) {
    pmAxisAngleQuatConvert(PM_Z, a->z, to);
    pmQuatAxisAngleMult(to, PM_Y, a->y, to);
    return pmQuatAxisAngleMult(to, PM_Z, a->zp, to);
}
static inline int pmZyxQuatConvert(const PmEulerZyx* a, PmQuaternion* to) {
    pmAxisAngleQuatConvert(PM_Z, a->z, to);
    pmQuatAxisAngleMult(to, PM_Y, a->y, to);
    return pmQuatAxisAngleMult(to, PM_X, a->x, to);
}
/* Where the middle angle makes the first and the third one rotation, all of it is given as the
 * first. */
static inline int pmMatZyzConvert(const PmRotationMatrix* m, PmEulerZyz* to) {
    const double level = hypot(m->z.x, m->z.y);
    const double y = atan2(level, m->z.z);
    if (level < 1e-6) {
        *to = (PmEulerZyz){m->z.z > 0.0 ? atan2(m->x.y, m->x.x) : atan2(-m->x.y, -m->x.x), y, 0.0};

        return 0;
    }
    *to = (PmEulerZyz){atan2(m->z.y, m->z.x), y, atan2(m->y.z, -m->x.z)};
    return 0;
}
static inline int pmMatZyxConvert(const PmRotationMatrix* m, PmEulerZyx* to) {
    const double level = hypot(m->x.x, m->x.y);
    const double y = atan2(-m->x.z, level);
    if (level < 1e-6) {
        *to = (PmEulerZyx){atan2(-m->y.x, m->y.y), y, 0.0};
        return 0;
    }
    *to = (PmEulerZyx){atan2(m->x.y, m->x.x), y, atan2(m->y.z, m->z.z)};
    return 0;
}
/* Every other pair of rotations goes through a quaternion or a matrix. */
#define __PM_THROUGH(From, from, Middle, middle, Last, last)                   \
    static inline int pm##from##last##Convert(const From* a, Last* to) {       \
        Middle between;                                                        \
        const int result = pm##from##middle##Convert(a, &between);             \
        return result != 0 ? result : pm##middle##last##Convert(&between, to); \
    }
__PM_THROUGH(PmRotationVector, Rot, PmQuaternion, Quat, PmRotationMatrix, Mat)
__PM_THROUGH(PmEulerZyz, Zyz, PmQuaternion, Quat, PmRotationMatrix, Mat)
__PM_THROUGH(PmEulerZyx, Zyx, PmQuaternion, Quat, PmRotationMatrix, Mat)
__PM_THROUGH(PmQuaternion, Quat, PmRotationMatrix, Mat, PmEulerZyz, Zyz)
__PM_THROUGH(PmQuaternion, Quat, PmRotationMatrix, Mat, PmEulerZyx, Zyx)
__PM_THROUGH(PmRotationVector, Rot, PmRotationMatrix, Mat, PmEulerZyz, Zyz)
__PM_THROUGH(PmRotationVector, Rot, PmRotationMatrix, Mat, PmEulerZyx, Zyx)
__PM_THROUGH(PmRotationVector, Rot, PmRotationMatrix, Mat, PmRpy, Rpy)
__PM_THROUGH(PmRotationMatrix, Mat, PmQuaternion, Quat, PmRotationVector, Rot)
__PM_THROUGH(PmEulerZyz, Zyz, PmQuaternion, Quat, PmRotationVector, Rot)
__PM_THROUGH(PmEulerZyz, Zyz, PmRotationMatrix, Mat, PmEulerZyx, Zyx)
__PM_THROUGH(PmEulerZyz, Zyz, PmRotationMatrix, Mat, PmRpy, Rpy)
__PM_THROUGH(PmEulerZyx, Zyx, PmQuaternion, Quat, PmRotationVector, Rot)
__PM_THROUGH(PmEulerZyx, Zyx, PmRotationMatrix, Mat, PmEulerZyz, Zyz)
__PM_THROUGH(PmEulerZyx, Zyx, PmRotationMatrix, Mat, PmRpy, Rpy)
__PM_THROUGH(PmRpy, Rpy, PmQuaternion, Quat, PmRotationVector, Rot)
__PM_THROUGH(PmRpy, Rpy, PmRotationMatrix, Mat, PmEulerZyz, Zyz)
__PM_THROUGH(PmRpy, Rpy, PmRotationMatrix, Mat, PmEulerZyx, Zyx)
#undef __PM_THROUGH

static inline int pmMatIsNorm(const PmRotationMatrix* m) {
    PmCartesian z;
    pmCartCartCross(&m->x, &m->y, &z);
    return pmCartIsNorm(&m->x) && pmCartIsNorm(&m->y) && pmCartCartCompare(&z, &m->z);
}
/* x keeps its direction, y its plane with x. */
static inline int pmMatNorm(const PmRotationMatrix* m, PmRotationMatrix* to) {
    PmRotationMatrix n;
    if (pmCartUnit(&m->x, &n.x) || pmCartPlaneProj(&m->y, &n.x, &n.y) || pmCartUnit(&n.y, &n.y)) {
        return PM_NORM_ERR;
    }
    pmCartCartCross(&n.x, &n.y, &n.z);
    *to = n;
    return 0;
}
static inline int pmMatCartMult(const PmRotationMatrix* m, const PmCartesian* v, PmCartesian* to) {
    return __pm_vector(to, m->x.x * v->x + m->y.x * v->y + m->z.x * v->z,
                       m->x.y * v->x + m->y.y * v->y + m->z.y * v->z,
                       m->x.z * v->x + m->y.z * v->y + m->z.z * v->z);
}
static inline int pmMatMatMult(const PmRotationMatrix* a, const PmRotationMatrix* b,
                               PmRotationMatrix* to) {
    PmRotationMatrix m;
    pmMatCartMult(a, &b->x, &m.x);
    pmMatCartMult(a, &b->y, &m.y);
    pmMatCartMult(a, &b->z, &m.z);
    *to = m;
    return 0;
}
static inline int pmMatInv(const PmRotationMatrix* m, PmRotationMatrix* to) {
    *to = (PmRotationMatrix){
        {m->x.x, m->y.x, m->z.x}, {m->x.y, m->y.y, m->z.y}, {m->x.z, m->y.z, m->z.z}};

    return 0;
}

/* --- poses --- */

static inline int pmPosePoseCompare(const PmPose* a, const PmPose* b) {
    return pmCartCartCompare(&a->tran, &b->tran) && pmQuatQuatCompare(&a->rot, &b->rot);
}
static inline int pmPoseCartMult(const PmPose* p, const PmCartesian* v, PmCartesian* to) {
    PmCartesian turned;
    pmQuatCartMult(&p->rot, v, &turned);
    return pmCartCartAdd(&p->tran, &turned, to);
}
static inline int pmPosePoseMult(const PmPose* a, const PmPose* b, PmPose* to) {
    PmPose p;
    const int result = pmPoseCartMult(a, &b->tran, &p.tran);
    pmQuatQuatMult(&a->rot, &b->rot, &p.rot);
    *to = p;
    return result;
}
static inline int pmPoseInv(const PmPose* p, PmPose* to) {
    PmPose inverse;
    pmQuatInv(&p->rot, &inverse.rot);
    pmQuatCartMult(&inverse.rot, &p->tran, &inverse.tran);
    pmCartNegEq(&inverse.tran);
    *to = inverse;
    return 0;
}
static inline int pmPoseHomConvert(const PmPose* p, PmHomogeneous* to) {
    to->tran = p->tran;
    return pmQuatMatConvert(&p->rot, &to->rot);
}
static inline int pmHomPoseConvert(const PmHomogeneous* h, PmPose* to) {
    to->tran = h->tran;
    return pmMatQuatConvert(&h->rot, &to->rot);
}
static inline int pmHomInv(const PmHomogeneous* h, PmHomogeneous* to) {
    PmHomogeneous inverse;
    pmMatInv(&h->rot, &inverse.rot);
    pmMatCartMult(&inverse.rot, &h->tran, &inverse.tran);
    pmCartNegEq(&inverse.tran);
    *to = inverse;
    return 0;
}

#endif
