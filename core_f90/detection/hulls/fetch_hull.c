/* Brings what a kernel will read of a hull into the cache ahead of its turn: the one thing Fortran has no word for. The
 * memory of many different hulls is far away, and who waits for it at every pair waits a third of the time. */
#include "cairn/core.h"

enum { line = 64, most = 2048 }; /* bytes: of a cache line; of each array of a hull with many faces */

/* A macro, because the compiler takes calls of a function that does nothing but this for useless. */
#define FETCH(array, first, last)                                                                                      \
  do {                                                                                                                 \
    const char* from = (const char*)((array) + (first));                                                               \
    const char* to = (const char*)((array) + (last)) - 1;                                                              \
    if (to - from > most) to = from + most;                                                                            \
    for (const char* at = from; at < to; at += line) __builtin_prefetch(at);                                           \
    __builtin_prefetch(to);                                                                                            \
  } while (0)

void cairn_fetch_hull(const cairn_hulls* hulls, int32_t contactor, int32_t feature) {
  const int32_t h = hulls->hull[contactor];
  const int32_t face = hulls->first_face[h], last_face = hulls->first_face[h + 1];
  const int32_t edge = hulls->first_edge[h], last_edge = hulls->first_edge[h + 1];
  const int32_t corner = hulls->first_corner[face], last_corner = hulls->first_corner[last_face];
  const int32_t vertices = hulls->first_vertex[h + 1] - hulls->first_vertex[h];
  const double* turned = hulls->turned + hulls->place[contactor];
  FETCH(turned, 0, 3 * (vertices + last_face - face));
  if (feature < 0 && feature >= edge - last_edge)
    __builtin_prefetch(hulls->edge + 4 * (edge - feature - 1));
  else if (feature == 0)
    FETCH(hulls->edge, 4 * edge, 4 * last_edge);
  FETCH(hulls->offset, face, last_face);
  FETCH(hulls->corner_vertex, corner, last_corner);
  FETCH(hulls->corner_edge, corner, last_corner);
}
