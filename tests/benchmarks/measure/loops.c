/* Plain C loops over whole logs: what a compiler makes of the equations when every size is known to it.
 *
 * The update is the shortest one, P <- P - W'W with W = L^-1 H P and S = L L', which is quick and not safe
 * (see tests/sequential/filters for where it fails); mean, covariance and log likelihood are kept.  Arrays have
 * a fixed size and are copied element by element, so that the compiler can hold them in registers: twice as
 * quick at two states as arrays of variable size and memcpy.
 */
#include <math.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))
enum { STATES = 9, ROWS = 3 }; /* at most */

INLINE void copy(int count, const double *from, double *to) {
  for (int i = 0; i < count; i++) to[i] = from[i];
}

/* x <- F x, P <- F P F' + Q */
INLINE void predict(int n, const double *F, const double *Q, double *x, double *P) {
  double moved[STATES], FP[STATES * STATES];
  for (int i = 0; i < n; i++) {
    double s = 0.0;
    for (int k = 0; k < n; k++) s += F[i * n + k] * x[k];
    moved[i] = s;
  }
  copy(n, moved, x);
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      double s = 0.0;
      for (int k = 0; k < n; k++) s += F[i * n + k] * P[k * n + j];
      FP[i * n + j] = s;
    }
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      double s = Q[i * n + j];
      for (int k = 0; k < n; k++) s += FP[i * n + k] * F[j * n + k];
      P[i * n + j] = s;
    }
}

/* Update by an innovation; returns the log likelihood. */
INLINE double update(int n, int m, const double *H, const double *R, const double *innovation, double *x,
                     double *P) {
  double W[ROWS * STATES], L[ROWS * ROWS], white[ROWS], log_likelihood = -0.5 * m * log(2.0 * M_PI);
  for (int i = 0; i < m; i++)
    for (int j = 0; j < n; j++) {
      double s = 0.0;
      for (int k = 0; k < n; k++) s += H[i * n + k] * P[k * n + j];
      W[i * n + j] = s;
    }
  for (int i = 0; i < m; i++)
    for (int j = 0; j <= i; j++) {
      double s = R[i * m + j];
      for (int k = 0; k < n; k++) s += W[i * n + k] * H[j * n + k];
      L[i * m + j] = s;
    }
  for (int j = 0; j < m; j++) {
    double pivot = L[j * m + j], s = innovation[j];
    for (int k = 0; k < j; k++) pivot -= L[j * m + k] * L[j * m + k];
    pivot = sqrt(pivot);
    double inverse = 1.0 / pivot;
    log_likelihood -= log(pivot);
    for (int i = j + 1; i < m; i++) {
      double below = L[i * m + j];
      for (int k = 0; k < j; k++) below -= L[i * m + k] * L[j * m + k];
      L[i * m + j] = below * inverse;
    }
    for (int k = 0; k < j; k++) s -= L[j * m + k] * white[k];
    white[j] = s * inverse;
    log_likelihood -= 0.5 * white[j] * white[j];
    for (int i = 0; i < n; i++) {
      double w = W[j * n + i];
      for (int k = 0; k < j; k++) w -= L[j * m + k] * W[k * n + i];
      W[j * n + i] = w * inverse;
    }
  }
  for (int i = 0; i < n; i++) {
    double s = x[i];
    for (int k = 0; k < m; k++) s += W[k * n + i] * white[k];
    x[i] = s;
  }
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      double s = P[i * n + j];
      for (int k = 0; k < m; k++) s -= W[k * n + i] * W[k * n + j];
      P[i * n + j] = s;
    }
  return log_likelihood;
}

INLINE double linear(int n, int m, long steps, const double *F, const double *H, const double *Q,
                     const double *R, const double *x0, const double *P0, const double *z, double *mean,
                     double *cov) {
  double own_F[STATES * STATES], own_H[ROWS * STATES], own_Q[STATES * STATES], own_R[ROWS * ROWS];
  double x[STATES], P[STATES * STATES], innovation[ROWS], log_likelihood = 0.0;
  copy(n * n, F, own_F);
  copy(m * n, H, own_H);
  copy(n * n, Q, own_Q);
  copy(m * m, R, own_R);
  copy(n, x0, x);
  copy(n * n, P0, P);
  for (long t = 0; t < steps; t++) {
    predict(n, own_F, own_Q, x, P);
    for (int i = 0; i < m; i++) {
      double s = z[t * m + i];
      for (int k = 0; k < n; k++) s -= own_H[i * n + k] * x[k];
      innovation[i] = s;
    }
    log_likelihood += update(n, m, own_H, own_R, innovation, x, P);
    copy(n, x, mean + t * n);
    copy(n * n, P, cov + t * n * n);
  }
  return log_likelihood;
}

#define LINEAR(n, m)                                                                                          \
  double linear_##n##_##m(long steps, const double *F, const double *H, const double *Q, const double *R,     \
                          const double *x0, const double *P0, const double *z, double *mean, double *cov) {   \
    return linear(n, m, steps, F, H, Q, R, x0, P0, z, mean, cov);                                             \
  }
LINEAR(2, 1)
LINEAR(4, 2)
LINEAR(9, 3)

void series_4_2(long count, long steps, const double *F, const double *H, const double *Q, const double *R,
                const double *x0, const double *P0, const double *z, double *mean, double *cov) {
  for (long s = 0; s < count; s++)
    linear_4_2(steps, F, H, Q, R, x0, P0, z + 2 * s * steps, mean + 4 * s * steps, cov + 16 * s * steps);
}

/* A unicycle of known speed and turn rate sees the range to one landmark and the bearing of another. */
static const double SPEED = 1.0, TURN = 0.1, RANGED[2] = {2.0, 3.0}, SEEN[2] = {-4.0, 14.0};

INLINE double wrapped(double angle) { return angle - 2.0 * M_PI * floor((angle + M_PI) / (2.0 * M_PI)); }

INLINE void step(double dt, double *x) {
  x[0] += SPEED * dt * cos(x[2]);
  x[1] += SPEED * dt * sin(x[2]);
  x[2] += TURN * dt;
}

INLINE void observe(const double *x, double *out) {
  out[0] = sqrt((RANGED[0] - x[0]) * (RANGED[0] - x[0]) + (RANGED[1] - x[1]) * (RANGED[1] - x[1]));
  out[1] = atan2(SEEN[1] - x[1], SEEN[0] - x[0]) - x[2];
}

double extended(long steps, double dt, const double *Q, const double *R, const double *x0, const double *P0,
                const double *z, double *mean, double *cov) {
  double x[3], P[9], own_Q[9], own_R[4], log_likelihood = 0.0;
  copy(9, Q, own_Q);
  copy(4, R, own_R);
  copy(3, x0, x);
  copy(9, P0, P);
  for (long t = 0; t < steps; t++) {
    double c = cos(x[2]), s = sin(x[2]), none[3] = {0.0, 0.0, 0.0}, expected[2];
    double F[9] = {1.0, 0.0, -SPEED * dt * s, 0.0, 1.0, SPEED * dt * c, 0.0, 0.0, 1.0};
    predict(3, F, own_Q, none, P);
    x[0] += SPEED * dt * c;
    x[1] += SPEED * dt * s;
    x[2] += TURN * dt;
    observe(x, expected);
    double dx = RANGED[0] - x[0], dy = RANGED[1] - x[1], ex = SEEN[0] - x[0], ey = SEEN[1] - x[1];
    double square = ex * ex + ey * ey;
    double H[6] = {-dx / expected[0], -dy / expected[0], 0.0, ey / square, -ex / square, -1.0};
    double innovation[2] = {z[2 * t] - expected[0], wrapped(z[2 * t + 1] - expected[1])};
    log_likelihood += update(3, 2, H, own_R, innovation, x, P);
    copy(3, x, mean + 3 * t);
    copy(9, P, cov + 9 * t);
  }
  return log_likelihood;
}

/* Sigma points of alpha = 1, beta = 2, kappa = 0: x, then x + and - sqrt(3) times the columns of L. */
INLINE void spread(const double *x, const double *P, double points[7][3]) {
  double L[3][3] = {{0.0}};
  for (int j = 0; j < 3; j++)
    for (int i = j; i < 3; i++) {
      double s = 3.0 * P[3 * i + j];
      for (int k = 0; k < j; k++) s -= L[i][k] * L[j][k];
      L[i][j] = i == j ? sqrt(s) : s / L[j][j];
    }
  for (int i = 0; i < 3; i++) {
    points[0][i] = x[i];
    for (int k = 0; k < 3; k++) {
      points[1 + k][i] = x[i] + L[i][k];
      points[4 + k][i] = x[i] - L[i][k];
    }
  }
}

double unscented(long steps, double dt, const double *Q, const double *R, const double *x0, const double *P0,
                 const double *z, double *mean, double *cov) {
  const double each = 1.0 / 6.0, central = 2.0;
  double x[3], P[9], log_likelihood = 0.0;
  copy(3, x0, x);
  copy(9, P0, P);
  for (long t = 0; t < steps; t++) {
    double points[7][3], seen[7][2], S[4], C[3][2], expected[2] = {0.0, 0.0};
    spread(x, P, points);
    memset(x, 0, sizeof x);
    for (int i = 0; i < 7; i++) {
      step(dt, points[i]);
      for (int j = 0; j < 3; j++) x[j] += i ? each * points[i][j] : 0.0;
    }
    for (int a = 0; a < 3; a++)
      for (int b = 0; b <= a; b++) {
        double s = Q[3 * a + b];
        for (int i = 0; i < 7; i++) s += (i ? each : central) * (points[i][a] - x[a]) * (points[i][b] - x[b]);
        P[3 * a + b] = P[3 * b + a] = s;
      }
    spread(x, P, points);
    for (int i = 0; i < 7; i++) observe(points[i], seen[i]);
    double about = seen[0][1]; /* bearings as differences to the central one */
    for (int i = 0; i < 7; i++) {
      seen[i][1] = wrapped(seen[i][1] - about);
      for (int j = 0; j < 2; j++) expected[j] += i ? each * seen[i][j] : 0.0;
    }
    for (int i = 0; i < 7; i++) {
      seen[i][0] -= expected[0];
      seen[i][1] -= expected[1];
      for (int j = 0; j < 3; j++) points[i][j] -= x[j];
    }
    expected[1] += about;
    memcpy(S, R, sizeof S);
    memset(C, 0, sizeof C);
    for (int i = 0; i < 7; i++) {
      double w = i ? each : central;
      S[0] += w * seen[i][0] * seen[i][0];
      S[1] += w * seen[i][0] * seen[i][1];
      S[3] += w * seen[i][1] * seen[i][1];
      for (int a = 0; a < 3; a++)
        for (int b = 0; b < 2; b++) C[a][b] += w * points[i][a] * seen[i][b];
    }
    double det = S[0] * S[3] - S[1] * S[1], K[3][2];
    double inverse[3] = {S[3] / det, -S[1] / det, S[0] / det};
    double innovation[2] = {z[2 * t] - expected[0], wrapped(z[2 * t + 1] - expected[1])};
    for (int a = 0; a < 3; a++) {
      K[a][0] = C[a][0] * inverse[0] + C[a][1] * inverse[1];
      K[a][1] = C[a][0] * inverse[1] + C[a][1] * inverse[2];
      x[a] += K[a][0] * innovation[0] + K[a][1] * innovation[1];
    }
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++) P[3 * a + b] -= K[a][0] * C[b][0] + K[a][1] * C[b][1];
    log_likelihood -= 0.5 * (innovation[0] * innovation[0] * inverse[0] + innovation[1] * innovation[1] * inverse[2]) +
                      innovation[0] * innovation[1] * inverse[1] + 0.5 * log(det) + log(2.0 * M_PI);
    copy(3, x, mean + 3 * t);
    copy(9, P, cov + 9 * t);
  }
  return log_likelihood;
}
