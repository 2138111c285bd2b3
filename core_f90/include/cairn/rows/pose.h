/* Kernels that rows of poses/poses.def name. */
#ifndef CAIRN_POSE_ROWS_H
#define CAIRN_POSE_ROWS_H
#include "cairn/core.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CAIRN_POSE(name, python) cairn_pose cairn_pose_##name;
#include "../../../poses/poses.def"
#undef CAIRN_POSE

#ifdef __cplusplus
}
#endif
#endif
