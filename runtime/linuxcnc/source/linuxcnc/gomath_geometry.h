/* SPDX-License-Identifier: MIT */
/* Part of gomath.h: lines, planes, and the links of serial machines. */
#ifndef HALCYON_GOMATH_GEOMETRY_H
#define HALCYON_GOMATH_GEOMETRY_H

static inline int go_line_from_point_direction(const go_cart* point, const go_cart* direction,
                                               go_line* to) {
    const go_cart at = *point;
    if (go_cart_unit(direction, &to->direction)) return GO_RESULT_ERROR;
    to->point = at;
    return GO_RESULT_OK;
}
static inline int go_line_from_points(const go_cart* a, const go_cart* b, go_line* to) {
    const go_cart way = __go_plus(b, -1.0, a);
    return go_line_from_point_direction(a, &way, to);
}
static inline int go_line_evaluate(const go_line* line, go_real d, go_cart* to) {
    *to = __go_plus(&line->point, d, &line->direction);
    return GO_RESULT_OK;
}
/* The point of the line that is nearest to `point`. */
static inline int go_point_line_proj(const go_cart* point, const go_line* line, go_cart* to) {
    const go_cart way = __go_plus(point, -1.0, &line->point);
    return go_line_evaluate(line, __go_dot(&way, &line->direction), to);
}
static inline int go_point_line_distance(const go_cart* point, const go_line* line,
                                         go_real* distance) {
    go_cart nearest;
    go_point_line_proj(point, line, &nearest);
    return go_cart_cart_disp(point, &nearest, distance);
}
/* The same points in the same direction. */
static inline go_flag go_line_line_compare(const go_line* a, const go_line* b) {
    go_real apart;
    go_point_line_distance(&a->point, b, &apart);
    return GO_SMALL(apart) && go_cart_cart_compare(&a->direction, &b->direction);
}

static inline int go_plane_from_abcd(go_real a, go_real b, go_real c, go_real d, go_plane* to) {
    const go_cart normal = {a, b, c};
    const go_real size = sqrt(__go_dot(&normal, &normal));
    if (go_cart_unit(&normal, &to->normal)) return GO_RESULT_ERROR;
    to->d = d / size;
    return GO_RESULT_OK;
}
static inline int go_plane_from_point_normal(const go_cart* point, const go_cart* normal,
                                             go_plane* to) {
    return go_plane_from_abcd(normal->x, normal->y, normal->z, -__go_dot(point, normal), to);
}
static inline int go_plane_from_points(const go_cart* a, const go_cart* b, const go_cart* c,
                                       go_plane* to) {
    const go_cart ab = __go_plus(b, -1.0, a);
    const go_cart ac = __go_plus(c, -1.0, a);
    go_cart normal;
    go_cart_cart_cross(&ab, &ac, &normal);
    return go_plane_from_point_normal(a, &normal, to);
}
static inline int go_plane_from_point_line(const go_cart* point, const go_line* line,
                                           go_plane* to) {
    const go_cart next = __go_plus(&line->point, 1.0, &line->direction);
    return go_plane_from_points(point, &line->point, &next, to);
}
static inline go_flag go_plane_plane_compare(const go_plane* a, const go_plane* b) {
    return GO_CLOSE(a->d, b->d) && go_cart_cart_compare(&a->normal, &b->normal);
}
/* Negative on the side the normal points away from. */
static inline go_real __go_above(const go_cart* point, const go_plane* plane) {
    return __go_dot(point, &plane->normal) + plane->d;
}
static inline int go_point_plane_distance(const go_cart* point, const go_plane* plane,
                                          go_real* distance) {
    *distance = fabs(__go_above(point, plane));
    return GO_RESULT_OK;
}
static inline int go_point_plane_proj(const go_cart* point, const go_plane* plane, go_cart* to) {
    *to = __go_plus(point, -__go_above(point, plane), &plane->normal);
    return GO_RESULT_OK;
}
/* A line at right angles to the plane has no projection. */
static inline int go_line_plane_proj(const go_line* line, const go_plane* plane, go_line* to) {
    go_cart point, direction;
    go_point_plane_proj(&line->point, plane, &point);
    go_cart_plane_proj(&line->direction, &plane->normal, &direction);
    return sqrt(__go_dot(&direction, &direction)) < GO_REAL_EPSILON
               ? GO_RESULT_ERROR
               : go_line_from_point_direction(&point, &direction, to);
}
/* Coordinates in the plane: their origin is the point nearest to that of space. */
static inline int go_plane_evaluate(const go_plane* plane, go_real u, go_real v, go_cart* to) {
    go_cart along, across, at;
    go_cart_normal(&plane->normal, &along);
    go_cart_cart_cross(&plane->normal, &along, &across);
    go_cart_scale_mult(&plane->normal, -plane->d, &at);
    at = __go_plus(&at, u, &along);
    *to = __go_plus(&at, v, &across);
    return GO_RESULT_OK;
}
/* `distance` from the line's point to where it meets the plane; a line in the plane meets it at its
 * point. */
static inline int go_line_plane_intersect(const go_line* line, const go_plane* plane,
                                          go_cart* point, go_real* distance) {
    const go_real above = __go_above(&line->point, plane);

    const go_real sinks = -__go_dot(&line->direction, &plane->normal);
    if (GO_SMALL(sinks)) {
        if (!GO_SMALL(above)) return GO_RESULT_ERROR;
        *distance = 0.0;
        *point = line->point;
        return GO_RESULT_OK;
    }
    *distance = above / sinks;
    return go_line_evaluate(line, *distance, point);
}
static inline int go_line_from_planes(const go_plane* a, const go_plane* b, go_line* to) {
    go_cart direction, into, point;
    go_line inside;
    go_real ignored;
    go_cart_cart_cross(&a->normal, &b->normal, &direction);
    if (sqrt(__go_dot(&direction, &direction)) < GO_REAL_EPSILON) return GO_RESULT_ERROR;
    go_cart_cart_cross(&direction, &a->normal, &into); /* in plane a, towards b */
    go_cart_scale_mult(&a->normal, -a->d, &point);
    if (go_line_from_point_direction(&point, &into, &inside) ||
        go_line_plane_intersect(&inside, b, &point, &ignored)) {
        return GO_RESULT_ERROR;
    }
    return go_line_from_point_direction(&point, &direction, to);
}

/* --- links --- */

typedef struct {
    go_real a, alpha, d, theta;
} go_dh; /* as in Craig: a and alpha of the link before */
typedef struct {
    go_cart base, platform;
    go_real d;
} go_pk; /* of a parallel machine: its two ends and its length */
typedef struct {
    go_pose pose;
} go_pp; /* from the link before */
enum { GO_LINK_DH = 1, GO_LINK_PK, GO_LINK_PP };
typedef struct {
    union {
        go_dh dh;
        go_pk pk;
        go_pp pp;
    } u;
    go_flag type, quantity; /* GO_LINK_..., GO_QUANTITY_... */
} go_link;

/* Along and about x, then along and about the new z. */
static inline int go_dh_pose_convert(const go_dh* dh, go_pose* to) {
    go_pose first = {{dh->a, 0, 0}, __go_about(0, dh->alpha)};

    go_pose second = {{0, 0, dh->d}, __go_about(2, dh->theta)};
    const int result = go_pose_pose_mult(&first, &second, to);
    return result != GO_RESULT_OK ? result : go_quat_norm(&to->rot, &to->rot);
}
/* The link with its joint at this length or angle. */
static inline int go_link_joint_set(const go_link* link, go_real joint, go_link* to) {
    const int turns = link->quantity == GO_QUANTITY_ANGLE;
    *to = *link;
    switch (link->type) {
    case GO_LINK_DH: *(turns ? &to->u.dh.theta : &to->u.dh.d) = joint; return GO_RESULT_OK;
    case GO_LINK_PK: to->u.pk.d = joint; return turns ? GO_RESULT_ERROR : GO_RESULT_OK;
    case GO_LINK_PP: {
        const go_real distance = turns ? 0.0 : joint;
        const go_real angle = turns ? joint : 0.0;
        const go_pose moved = {{0, 0, distance}, __go_about(2, angle)};
        return go_pose_pose_mult(&link->u.pp.pose, &moved, &to->u.pp.pose);
    }
    default: return GO_RESULT_IMPL_ERROR;
    }
}
/* The pose of the last of `count` links in the frame of the first. */
static inline int go_link_pose_build(const go_link* links, go_integer count, go_pose* to) {
    go_pose all = go_pose_identity();
    for (go_integer i = 0; i < count; ++i) {
        go_pose one;
        if (links[i].type == GO_LINK_DH) {
            go_dh_pose_convert(&links[i].u.dh, &one);
        } else if (links[i].type == GO_LINK_PP) {
            one = links[i].u.pp.pose;
        } else {
            return GO_RESULT_IMPL_ERROR;
        }
        go_pose_pose_mult(&all, &one, &all);
    }
    *to = all;
    return GO_RESULT_OK;
}

#endif
