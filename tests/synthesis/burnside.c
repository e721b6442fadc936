/* Counts planar mechanisms (W = 1, joints of mobility 1 and 2) by Burnside's lemma, listing every fixed labelling.

   usage: nauty-geng -C k ... | nauty-multig -T ... | burnside BINARY P2 DEGREE...

   Reads contracted graphs ("k e  a b m  a b m ...", one a line), keeps those with the given degrees; the first degree
   is the frame's and must differ from the others.  An edge carries a word of joint mobilities whose sum is at most 3:
   1, 2, 11, 12, 21, 111; parallel edges carry at most one word of length 1.  The labelling is admissible when every
   vertex set U with two or more vertices has sum of (3 - F) over its edges <= 3 (|U| - 1) - 1.  A label is a multiset of
   words on the parallel edges between two vertices; the group permutes vertices.  Prints graphs, mechanisms. */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAXV = 10, MAXE = 24, WORDS = 6, MAXL = 4096 };
static const int weight[WORDS] = {2, 1, 1, 0, 0, 0};
static const int links[WORDS] = {0, 0, 1, 1, 1, 2};
static const int pairs[WORDS] = {0, 1, 0, 1, 1, 0};
static const int mirror[WORDS] = {0, 1, 2, 4, 3, 5};

/* what k parallel edges may carry: multisets of words, at most one of them a direct joint, total weight at most 2 */
static int labels[MAXE], label_weight[MAXE][MAXL], label_links[MAXE][MAXL], label_pairs[MAXE][MAXL];
static int label_even[MAXE][MAXL]; /* the same when read backwards */

static void collect(int m, int word, int left, const int *times) {
    if (word < WORDS) {
        int more[WORDS];
        memcpy(more, times, sizeof more);
        for (more[word] = 0; more[word] <= left; more[word]++) collect(m, word + 1, left - more[word], more);
        return;
    }
    int w = 0, l = 0, q = 0, even = 1;
    for (int i = 0; i < WORDS; i++) {
        w += times[i] * weight[i], l += times[i] * links[i], q += times[i] * pairs[i];
        even &= times[i] == times[mirror[i]];
    }
    if (left || w > 2 || times[0] + times[1] > 1) return;
    int at = labels[m]++;
    if (at >= MAXL) exit(5);
    label_weight[m][at] = w, label_links[m][at] = l, label_pairs[m][at] = q, label_even[m][at] = even;
}

static int k, classes, from[MAXE], to[MAXE], mult[MAXV][MAXV], degree[MAXV], number[MAXV][MAXV];
static int binary, higher;

/* one group element: class c goes to image[c], read backwards if turned[c]; its cycles */
static int image[MAXE], turned[MAXE], cycles, length[MAXE], member[MAXE][MAXE], odd[MAXE];
static signed char slack[MAXE + 1][1 << MAXV];
static long long fixed;

static void descend(int cycle, int b, int q) {
    if (cycle == cycles) {
        fixed += b == 0 && q == 0;
        return;
    }
    int n = length[cycle], sets = 1 << k, c = member[cycle][0], m = mult[from[c]][to[c]];
    for (int label = 0; label < labels[m]; label++) {
        int w = label_weight[m][label], b_left = b - n * label_links[m][label], q_left = q - n * label_pairs[m][label];
        if (b_left < 0 || q_left < 0 || (odd[cycle] && !label_even[m][label])) continue;
        signed char *now = slack[cycle + 1];
        memcpy(now, slack[cycle], sets);
        signed char worst = 0;
        for (int i = 0; i < n; i++) {
            int pair = 1 << from[member[cycle][i]] | 1 << to[member[cycle][i]];
            for (int u = 0; u < sets; u++) {
                now[u] = (signed char)(now[u] - ((u & pair) == pair ? w : 0));
                worst |= now[u];
            }
        }
        if (worst >= 0) descend(cycle + 1, b_left, q_left); /* no sign bit: no set is overloaded */
    }
}

static long long fixed_by(void) {
    int seen[MAXE] = {0};
    cycles = 0;
    for (int c = 0; c < classes; c++) {
        if (seen[c]) continue;
        int n = 0, turn = 0;
        for (int d = c; !seen[d]; d = image[d]) {
            seen[d] = 1;
            member[cycles][n++] = d;
            turn ^= turned[d];
        }
        length[cycles] = n;
        odd[cycles++] = turn;
    }
    for (int u = 0; u < 1 << k; u++) {
        int size = __builtin_popcount(u);
        slack[0][u] = size >= 2 ? 3 * (size - 1) - 1 : 100;
    }
    fixed = 0;
    descend(0, binary, higher);
    return fixed;
}

static int perm[MAXV], used[MAXV];
static long long total, order;

static void vertex_permutations(int v) {
    if (v == k) {
        for (int c = 0; c < classes; c++) {
            int x = perm[from[c]], y = perm[to[c]];
            turned[c] = x > y;
            image[c] = x > y ? number[y][x] : number[x][y];
        }
        order++;
        total += fixed_by();
        return;
    }
    for (int x = 0; x < k; x++) {
        int good = !used[x] && degree[x] == degree[v];
        for (int w = 0; good && w < v; w++) good = mult[v][w] == mult[x][perm[w]];
        if (!good) continue;
        used[x] = 1;
        perm[v] = x;
        vertex_permutations(v + 1);
        used[x] = 0;
    }
}

static int descending(const void *a, const void *b) { return *(const int *)b - *(const int *)a; }

int main(int count, char **words) {
    int wanted[MAXV], n = count - 3;
    if (count < 5 || n > MAXV) return 2;
    binary = atoi(words[1]);
    higher = atoi(words[2]);
    for (int i = 0; i < n; i++) wanted[i] = atoi(words[3 + i]);
    qsort(wanted, n, sizeof *wanted, descending);
    long long graphs = 0, mechanisms = 0;
    for (int m = 1; m < MAXE; m++) collect(m, 0, m, (const int[WORDS]){0});
    while (scanf("%d %d", &k, &classes) == 2) {
        memset(mult, 0, sizeof mult);
        memset(degree, 0, sizeof degree);
        for (int i = 0; i < classes; i++) {
            int a, b, m;
            if (scanf("%d %d %d", &a, &b, &m) != 3) return 3;
            mult[a][b] = mult[b][a] = m;
            degree[a] += m, degree[b] += m;
        }
        int sorted[MAXV], same = k == n;
        memcpy(sorted, degree, sizeof degree);
        qsort(sorted, k, sizeof *sorted, descending);
        for (int i = 0; same && i < k; i++) same = sorted[i] == wanted[i];
        if (!same) continue;
        classes = 0;
        for (int a = 0; a < k; a++)
            for (int b = a + 1; b < k; b++)
                if (mult[a][b]) from[classes] = a, to[classes] = b, number[a][b] = classes++;
        total = order = 0;
        vertex_permutations(0);
        if (total % order) return 4;
        graphs++;
        mechanisms += total / order;
    }
    printf("%lld %lld\n", graphs, mechanisms);
    return 0;
}
