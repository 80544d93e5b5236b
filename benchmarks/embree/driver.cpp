// Embree on the scenes of our benchmarks: `driver scene threads repeat rays FILE` or
// `driver scene threads repeat frame FILE`. Prints a JSON object a line: the build, then a
// measurement of each packet width and query. `once` in place of `frame` is 16 wide only.
//
// `scene` is a text file beside the arrays it names, one object or placement a line:
//   sphere                          the unit sphere, as user geometry
//   mesh POINTS TRIANGLES           float32 (n, 3) and uint32 (n, 3)
//   place OBJECT MATRICES           instances of object number OBJECT, float32 (n, 3, 4)
// Rays are six float32 columns: origins, then directions. A frame is 18 float32: eye, the picture's
// middle, its half width and half height as vectors, the unit vector to the sun, width, height and
// occlusion rays per pixel (0: a shadow ray to the sun).
//
// Written from Embree's API documentation (version 3.13). Seconds are CPU seconds over threads.
#include "scene.h"

// ---- rays

template <int N> struct alignas(64) Packet {
    Block<N> b;
    alignas(64) int valid[16];

    // All lanes active, looking everywhere, nothing found.
    void reset() {
        memset(&b.row[TIME], 0, sizeof b.row[0]);
        memset(&b.row[NEAR], 0, sizeof b.row[0]);
        memset(&b.row[MASK], -1, sizeof b.row[0]);
        memset(&b.row[ID], 0, 2 * sizeof b.row[0]);
        memset(&b.row[PRIM], -1, 3 * sizeof b.row[0]);
        for (int i = 0; i < N; i++) { b.row[FAR][i] = INFINITY; valid[i] = -1; }
    }
    unsigned number(int row, int i) const { unsigned n; memcpy(&n, &b.row[row][i], 4); return n; }
    bool hit(int i) const { return number(GEOM, i) != RTC_INVALID_GEOMETRY_ID; }

    void trace(RTCScene scene, bool any, bool coherent) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        if constexpr (N == 1) {
            any ? rtcOccluded1(scene, &context, (RTCRay*)&b)
                : rtcIntersect1(scene, &context, (RTCRayHit*)&b);
        } else if constexpr (N == 8) {
            any ? rtcOccluded8(valid, scene, &context, (RTCRay8*)&b)
                : rtcIntersect8(valid, scene, &context, (RTCRayHit8*)&b);
        } else {
            any ? rtcOccluded16(valid, scene, &context, (RTCRay16*)&b)
                : rtcIntersect16(valid, scene, &context, (RTCRayHit16*)&b);
        }
    }
};

static void parallel(int threads, size_t count, const std::function<void(size_t, size_t)>& work) {
    vector<std::thread> all;
    for (int i = 0; i < threads; i++)
        all.emplace_back([&, i] {
            _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
            _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
            work(count * size_t(i) / size_t(threads), count * size_t(i + 1) / size_t(threads));
        });
    for (auto& thread : all) thread.join();
}

template <int N>
static void batch(RTCScene scene, int threads, bool any, bool coherent, const vector<float>& rays,
                  vector<float>& t, vector<unsigned>& instance) {
    size_t n = rays.size() / 6;
    parallel(threads, n / N, [&](size_t begin, size_t end) {
        Packet<N> p;
        for (size_t i = begin * N; i < end * N; i += N) {
            p.reset();
            for (int k = 0; k < 3; k++) {
                memcpy(p.b.row[ORG + k], &rays[size_t(k) * n + i], 4 * N);
                memcpy(p.b.row[DIR + k], &rays[size_t(k + 3) * n + i], 4 * N);
            }
            p.trace(scene, any, coherent);
            memcpy(&t[i], p.b.row[FAR], 4 * N);
            if (!any) memcpy(&instance[i], p.b.row[INST], 4 * N);
        }
    });
}

// ---- pictures: one sample a pixel, in 4 x 4 tiles; a shadow ray to the sun, or occlusion rays

// Turns the hit of lane i into a point off the surface and a unit normal towards the eye.
template <int N> static void surface(const Packet<N>& p, int i, float point[3], float normal[3]) {
    const float* c = &cofactors[9 * size_t(p.number(INST, i))];
    float length = 0, along = 0;
    for (int k = 0; k < 3; k++) {
        normal[k] = 0;
        for (int j = 0; j < 3; j++) normal[k] += c[3 * k + j] * p.b.row[NG + j][i];
        length += normal[k] * normal[k];
        along += normal[k] * p.b.row[DIR + k][i];
    }
    float scale = (along > 0 ? -1 : 1) / std::sqrt(length);
    for (int k = 0; k < 3; k++) {
        normal[k] *= scale;
        point[k] = p.b.row[ORG + k][i] + p.b.row[FAR][i] * p.b.row[DIR + k][i] + 1e-3f * normal[k];
    }
}

static float uniform(uint64_t& state) {  // PCG
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    uint32_t x = uint32_t(((state >> 18) ^ state) >> 27), turn = uint32_t(state >> 59);
    return float(((x >> turn) | (x << (-turn & 31))) >> 8) * 0x1p-24f;
}

template <int N>
static void picture(RTCScene scene, int threads, const float* view, vector<float>& image) {
    const float *eye = view, *middle = view + 3, *right = view + 6, *up = view + 9, *sun = view + 12;
    int width = int(view[15]), height = int(view[16]), occlusion = int(view[17]);
    parallel(threads, size_t(width / 4 * (height / 4)), [&](size_t begin, size_t end) {
        Packet<N> p, q;
        float point[N][3] = {}, normal[N][3] = {};
        for (size_t i = begin * 16; i < end * 16; i += N) {
            uint64_t state = i;
            size_t pixel[N];
            p.reset();
            for (int j = 0; j < N; j++) {
                size_t tile = (i + size_t(j)) / 16, place = (i + size_t(j)) % 16, columns = size_t(width / 4);
                size_t x = tile % columns * 4 + place % 4, y = tile / columns * 4 + place / 4;
                pixel[j] = y * size_t(width) + x;
                float u = float(2 * x + 1) / float(width) - 1, v = 1 - float(2 * y + 1) / float(height);
                for (int k = 0; k < 3; k++) {
                    p.b.row[ORG + k][j] = eye[k];
                    p.b.row[DIR + k][j] = middle[k] + u * right[k] + v * up[k];
                }
            }
            p.trace(scene, false, true);
            q.reset();
            for (int j = 0; j < N; j++) {
                float facing = 0;
                if (p.hit(j)) {
                    surface(p, j, point[j], normal[j]);
                    for (int k = 0; k < 3; k++) facing += normal[j][k] * sun[k];
                }
                image[pixel[j]] = p.hit(j) ? (occlusion ? 0 : 0.8f * std::max(facing, 0.0f)) : 1;
                q.valid[j] = facing > 0 ? -1 : 0;
                for (int k = 0; k < 3; k++) {
                    q.b.row[ORG + k][j] = q.valid[j] ? point[j][k] : 0;
                    q.b.row[DIR + k][j] = sun[k];
                }
            }
            if (!occlusion) {
                q.trace(scene, true, false);
                for (int j = 0; j < N; j++)
                    if (q.valid[j] && q.b.row[FAR][j] < 0) image[pixel[j]] = 0;
                continue;
            }
            for (int j = 0; j < N; j++) {
                const float* n = normal[j];
                for (int ray = 0; p.hit(j) && ray < occlusion; ray += N) {
                    q.reset();
                    for (int l = 0; l < N; l++) {  // cosine-distributed: the normal and a unit vector
                        float z = 2 * uniform(state) - 1, turn = 6.2831853f * uniform(state);
                        float r = std::sqrt(1 - z * z);
                        float around[3] = {r * cosf(turn), r * sinf(turn), z};
                        for (int k = 0; k < 3; k++) {
                            q.b.row[ORG + k][l] = point[j][k];
                            q.b.row[DIR + k][l] = n[k] + 0.99999f * around[k];
                        }
                    }
                    q.trace(scene, true, false);
                    for (int l = 0; l < N; l++)
                        image[pixel[j]] += float(q.b.row[FAR][l] > 0) / float(occlusion);
                }
            }
        }
    });
}

template <int N> static void measure(RTCScene scene, int threads, int repeat, bool frame, const vector<float>& input) {
    size_t n = frame ? size_t(input[15] * input[16]) : input.size() / 6;
    vector<float> t(n);
    vector<unsigned> instance(n);
    for (int query = 0; query < (frame ? 1 : 4); query++) {
        bool any = query & 1, coherent = query & 2;
        double least = INFINITY;
        for (int i = 0; i < repeat; i++) {
            double start = seconds(CLOCK_PROCESS_CPUTIME_ID);
            if (frame) picture<N>(scene, threads, input.data(), t);
            else batch<N>(scene, threads, any, coherent, input, t, instance);
            least = std::min(least, (seconds(CLOCK_PROCESS_CPUTIME_ID) - start) / threads);
        }
        double sum = 0;
        size_t hits = 0;
        for (size_t i = 0; i < n; i++) {
            bool hit = frame || (any ? t[i] < 0 : t[i] < INFINITY);
            hits += hit;
            if (hit && !any) sum += t[i];
        }
        printf("{\"width\": %d, \"query\": \"%s\", \"seconds\": %.6f, \"hits\": %zu, \"sum\": %.9g}\n",
               N, frame ? "frame" : any ? "any" : "closest", least, hits, sum);
        fflush(stdout);
    }
}

int main(int count, char** words) {
    if (count != 6) { fprintf(stderr, "driver scene threads repeat rays|frame|once FILE\n"); return 2; }
    std::string path = words[1];
    folder = path.substr(0, path.rfind('/') + 1);
    int threads = atoi(words[2]), repeat = atoi(words[3]);
    bool once = !strcmp(words[4], "once"), frame = once || !strcmp(words[4], "frame");
    RTCDevice device = rtcNewDevice(("threads=" + std::to_string(threads)).c_str());
    double start = seconds(CLOCK_PROCESS_CPUTIME_ID);
    RTCScene scene = build(device, path);
    printf("{\"build\": %.6f}\n", seconds(CLOCK_PROCESS_CPUTIME_ID) - start);
    auto input = read<float>(words[5]);
    if (!once) measure<8>(scene, threads, repeat, frame, input);
    measure<16>(scene, threads, repeat, frame, input);
    if (!frame) measure<1>(scene, threads, repeat, frame, input);
    return rtcGetDeviceError(device) == RTC_ERROR_NONE ? 0 : 1;
}
