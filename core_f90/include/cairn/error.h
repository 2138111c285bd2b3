/* What a call reports when it was wrong. */
#ifndef CAIRN_ERROR_H
#define CAIRN_ERROR_H
#include <stdint.h>

/* Owned by the caller; code 0 is success. */
typedef struct cairn_error {
  int32_t code;
  int64_t item;
  char message[256];
} cairn_error;

#endif
