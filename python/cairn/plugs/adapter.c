/* Adapter that offers the scalar routine @ROUTINE@ to Cairn as the contact law @NAME@, contact by contact.
 * Written by cairn wrap-law. Build:
 *   @BUILD@ */
#define _GNU_SOURCE
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

/* As cairn/core.h and cairn/plug.h declare them; Cairn checks the sizes when it loads the library. */
typedef struct cairn_law_context {
  double h, theta;
  const double *geometry, *fields;
} cairn_law_context;
typedef void prepare_slot(int32_t, int32_t, const cairn_law_context*, const double*, const double*, const double*, double*,
                          double*, double*, double*);
typedef void solve_slot(int32_t, int32_t, const double*, const double*, const double*, const double*, const double*,
                        double*, int32_t*);
typedef struct descriptor_type {
  int32_t abi, size, context_size, kind, components2, components3, normal_bias, thread_unsafe;
  char name[64], parameters[1024], state[1024];
  prepare_slot* prepare;
  solve_slot* solve;
  void (*commit)(void);
  void (*force)(void);
  const char* (*complaint)(void);
} descriptor_type;

@DECLARATION@

enum { isolate = @ISOLATE@, parameters = @PARAMETER_COUNT@, states = @STATE_COUNT@ };
static char complaint_text[2048];
static const char* complaint(void) { return complaint_text; }

/* One contact after the other. in: w (n, c, c), u (n, c), bias (n, c), params, state; out: r, status. */
static void call_solve(int32_t n, int32_t c, const double* w, const double* u, const double* bias, const double* params,
                       const double* state, double* r, int32_t* status) {
  (void)w, (void)u, (void)bias, (void)params, (void)state, (void)c;
  for (int32_t i = 0; i < n; ++i) {
@SOLVE@
  }
}

static void call_prepare(int32_t n, int32_t c, const double* step, const double* gap, const double* u, const double* params,
                         double* state, double* bias, double* compliance, double* mu) {
  const double h = step[0], theta = step[1];
  (void)h, (void)theta, (void)u, (void)params, (void)state;
  for (int32_t i = 0; i < n * c; ++i) bias[i] = compliance[i] = 0;
  for (int32_t i = 0; i < n; ++i) {
    mu[i] = 0;
    bias[i] = fmax(gap[i], 0) / h;
@PREPARE@
  }
}

/* ---------------------------------------------------------------- a process of its own, so that a STOP ends that one */
enum { most = 2048, room = most * 96 };
static double* shared;     /* what both processes see */
static int to_child, from_child;
static pid_t child;
static FILE* words;        /* what the routine prints */

extern void _gfortran_flush_i4(int32_t*) __attribute__((weak));
static void leave(int code, void* unused) { /* before the handlers of the libraries that the parent has open */
  (void)unused;
  if (_gfortran_flush_i4) _gfortran_flush_i4(NULL);
  fflush(stdout);
  fflush(stderr);
  _exit(code);
}

typedef struct request { int32_t which, n, c; } request;

static void serve(int in, int out) {
  request q;
  while (read(in, &q, sizeof q) == (ssize_t)sizeof q) {
    double* at = shared;
    const int32_t n = q.n, c = q.c;
    if (q.which == 0) {
      double *w = at, *u = w + n * c * c, *bias = u + n * c, *params = bias + n * c, *state = params + n * parameters;
      double* r = state + n * states;
      call_solve(n, c, w, u, bias, params, state, r, (int32_t*)(r + n * c));
    } else {
      double *step = at, *gap = step + 2, *u = gap + n, *params = u + n * c, *state = params + n * parameters;
      double *bias = state + n * states, *compliance = bias + n * c;
      call_prepare(n, c, step, gap, u, params, state, bias, compliance, compliance + n * c);
    }
    if (write(out, "x", 1) != 1) break;
  }
  _exit(0);
}

static int start(void) {
  int down[2], up[2];
  if (!shared) {
    void* at = mmap(NULL, room * sizeof(double), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (at == MAP_FAILED) return 0;
    shared = at;
  }
  if (words) fclose(words);
  words = tmpfile();
  if (!words || pipe(down) || pipe(up)) return 0;
  child = fork();
  if (child < 0) return 0;
  if (child == 0) {
    on_exit(leave, NULL);
    dup2(fileno(words), 1);
    dup2(fileno(words), 2);
    close(down[1]);
    close(up[0]);
    serve(down[0], up[1]);
  }
  close(down[0]);
  close(up[1]);
  to_child = down[1];
  from_child = up[0];
  return 1;
}

static int ask(int32_t which, int32_t n, int32_t c) {
  const request q = {which, n, c};
  char answer;
  if (n > most || (child == 0 && !start())) {
    snprintf(complaint_text, sizeof complaint_text, "no process of its own could be started for @ROUTINE@");
    return 0;
  }
  if (write(to_child, &q, sizeof q) == (ssize_t)sizeof q && read(from_child, &answer, 1) == 1) return 1;
  int status = 0;
  waitpid(child, &status, 0);
  close(to_child);
  close(from_child);
  child = 0;
  char said[1024] = "";
  fflush(words);
  fseek(words, 0, SEEK_END);
  const long size = ftell(words);
  fseek(words, size > 1000 ? size - 1000 : 0, SEEK_SET);
  said[fread(said, 1, sizeof said - 1, words)] = 0;
  for (char* p = said; *p; ++p)
    if (*p == '\n') *p = ' ';
  snprintf(complaint_text, sizeof complaint_text, "@ROUTINE@ ended its process (%s %d); it said: %s",
           WIFSIGNALED(status) ? "signal" : "exit status", WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status), said);
  return 0;
}

static double* put(double* to, const double* from, size_t count) {
  if (count) memcpy(to, from, count * sizeof(double));
  return to + count;
}

static void solve(int32_t n, int32_t c, const double* w, const double* u, const double* bias, const double* params,
                  const double* state, double* r, int32_t* status) {
  int32_t unused[most];
  if (!isolate) {
    call_solve(n, c, w, u, bias, params, state, r, status ? status : unused);
    return;
  }
  if (!shared && !start()) child = 0;
  if (n <= most && shared) {
    double* at = put(put(put(shared, w, (size_t)n * c * c), u, (size_t)n * c), bias, (size_t)n * c);
    at = put(put(at, params, (size_t)n * parameters), state, (size_t)n * states);
    put(at, r, (size_t)n * c);
    if (ask(0, n, c)) {
      memcpy(r, at, (size_t)n * c * sizeof(double));
      if (status) memcpy(status, at + n * c, (size_t)n * sizeof(int32_t));
      return;
    }
  }
  for (int32_t i = 0; i < n * c; ++i) r[i] = NAN;
  if (status) memset(status, 0, (size_t)n * sizeof(int32_t));
}

static void prepare(int32_t n, int32_t c, const cairn_law_context* context, const double* gap, const double* u,
                    const double* params, double* state, double* bias, double* compliance, double* mu) {
  const double step[2] = {context->h, context->theta};
  if (!isolate || !@USES_PREPARE@) {
    call_prepare(n, c, step, gap, u, params, state, bias, compliance, mu);
    return;
  }
  if (!shared && !start()) child = 0;
  if (n <= most && shared) {
    double* at = put(put(put(shared, step, 2), gap, (size_t)n), u, (size_t)n * c);
    at = put(at, params, (size_t)n * parameters);
    double* here = at;
    at = put(at, state, (size_t)n * states);
    if (ask(1, n, c)) {
      memcpy(bias, at, (size_t)n * c * sizeof(double));
      memcpy(compliance, at + n * c, (size_t)n * c * sizeof(double));
      memcpy(mu, at + 2 * n * c, (size_t)n * sizeof(double));
      if (states) memcpy(state, here, (size_t)n * states * sizeof(double));
      return;
    }
  }
  for (int32_t i = 0; i < n * c; ++i) bias[i] = NAN, compliance[i] = 0;
  for (int32_t i = 0; i < n; ++i) mu[i] = 0;
}

void cairn_describe_@NAME@(descriptor_type* d) {
  d->abi = 1;
  d->size = sizeof *d;
  d->context_size = sizeof(cairn_law_context);
  d->kind = 1;
  d->components2 = @C2@;
  d->components3 = @C3@;
  d->thread_unsafe = @THREAD_UNSAFE@;
  strcpy(d->name, "@NAME@");
  strcpy(d->parameters, "@PARAMETERS@");
  strcpy(d->state, "@STATE@");
  d->prepare = prepare;
  d->solve = @USES_SOLVE@ ? solve : NULL;
  d->complaint = complaint;
}
