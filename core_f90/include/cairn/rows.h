/* Every kernel that a row of a list names, in the forms of core.h. Sources include the header of the list that they
 * read alone, so that a new row compiles few of them. */
#ifndef CAIRN_ROWS_H
#define CAIRN_ROWS_H
#include "cairn/fluid.h"
#include "cairn/rows/bulk_material.h"
#include "cairn/rows/conductance.h"
#include "cairn/rows/contact_terms.h"
#include "cairn/rows/element.h"
#include "cairn/rows/integrator.h"
#include "cairn/rows/law.h"
#include "cairn/rows/pair.h"
#include "cairn/rows/pose.h"
#include "cairn/rows/ranked_sweep.h"
#include "cairn/rows/side.h"
#include "cairn/seams.h"
#include "cairn/smooth_bodies.h"
#endif
