// The scene of `driver.cpp`: reading arrays, the unit sphere as user geometry, building.
#pragma once
#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>
#include <pmmintrin.h>
#include <xmmintrin.h>

using std::vector;

static std::string folder;

template <class T> static vector<T> read(const std::string& name) {
    std::ifstream file(folder + name, std::ios::binary | std::ios::ate);
    if (!file) { fprintf(stderr, "cannot read %s%s\n", folder.c_str(), name.c_str()); exit(1); }
    vector<T> values(size_t(file.tellg()) / sizeof(T));
    file.seekg(0);
    file.read((char*)values.data(), std::streamsize(values.size() * sizeof(T)));
    return values;
}

static double seconds(clockid_t clock) {
    timespec t;
    clock_gettime(clock, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

// ---- the unit sphere as user geometry, N rays at a time

template <int N> struct Block { float row[23][N]; };  // the rows of RTCRayHit16 and its kin
enum { ORG = 0, NEAR = 3, DIR = 4, TIME = 7, FAR = 8, MASK = 9, ID = 10, FLAGS = 11, NG = 12, U = 15,
       V = 16, PRIM = 17, GEOM = 18, INST = 19 };

template <int N, bool ANY>
static void sphere(const int* valid, Block<N>& b, unsigned geom, const RTCIntersectContext* context) {
    float t[N];
    int hit[N];
    for (int i = 0; i < N; i++) {
        float o[3], d[3];
        for (int k = 0; k < 3; k++) { o[k] = b.row[ORG + k][i]; d[k] = b.row[DIR + k][i]; }
        float inverse = 1 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        float middle = -(o[0] * d[0] + o[1] * d[1] + o[2] * d[2]) * inverse;
        float x = o[0] + middle * d[0], y = o[1] + middle * d[1], z = o[2] + middle * d[2];
        float room = 1 - (x * x + y * y + z * z);
        float half = std::sqrt(std::max(room, 0.0f) * inverse);
        t[i] = middle - half > b.row[NEAR][i] ? middle - half : middle + half;
        hit[i] = valid[i] & -int((room >= 0) & (t[i] > b.row[NEAR][i]) & (t[i] < b.row[FAR][i]));
    }
    for (int i = 0; i < N; i++) {
        if (!hit[i]) continue;
        if (ANY) { b.row[FAR][i] = -INFINITY; continue; }
        b.row[FAR][i] = t[i];
        for (int k = 0; k < 3; k++) b.row[NG + k][i] = b.row[ORG + k][i] + t[i] * b.row[DIR + k][i];
        unsigned numbers[3] = {0, geom, context->instID[0]};
        for (int k = 0; k < 3; k++) memcpy(&b.row[PRIM + k][i], &numbers[k], 4);
    }
}

template <bool ANY>
static void sphere_any_width(const int* valid, void* rays, unsigned width, unsigned geom,
                             const RTCIntersectContext* context) {
    switch (width) {
        case 1: return sphere<1, ANY>(valid, *(Block<1>*)rays, geom, context);
        case 4: return sphere<4, ANY>(valid, *(Block<4>*)rays, geom, context);
        case 8: return sphere<8, ANY>(valid, *(Block<8>*)rays, geom, context);
        case 16: return sphere<16, ANY>(valid, *(Block<16>*)rays, geom, context);
        default: abort();
    }
}

// ---- the scene

static vector<float> cofactors;  // of the instances' matrices, which turn normals; 9 each

static void attach(RTCScene scene, RTCGeometry geometry) {
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
}

static RTCGeometry object(RTCDevice device, std::istringstream& words, const std::string& kind) {
    if (kind == "sphere") {
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry, 1);
        rtcSetGeometryBoundsFunction(geometry, [](const RTCBoundsFunctionArguments* a) {
            *a->bounds_o = {-1, -1, -1, 0, 1, 1, 1, 0};
        }, nullptr);
        rtcSetGeometryIntersectFunction(geometry, [](const RTCIntersectFunctionNArguments* a) {
            sphere_any_width<false>(a->valid, a->rayhit, a->N, a->geomID, a->context);
        });
        rtcSetGeometryOccludedFunction(geometry, [](const RTCOccludedFunctionNArguments* a) {
            sphere_any_width<true>(a->valid, a->ray, a->N, a->geomID, a->context);
        });
        return geometry;
    }
    std::string points, triangles;
    words >> points >> triangles;
    auto p = read<float>(points);
    auto t = read<unsigned>(triangles);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto buffer = [&](RTCBufferType type, RTCFormat format, const void* from, size_t count) {
        memcpy(rtcSetNewGeometryBuffer(geometry, type, 0, format, 12, count), from, 12 * count);
    };
    buffer(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, p.data(), p.size() / 3);
    buffer(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, t.data(), t.size() / 3);
    return geometry;
}

static RTCScene build(RTCDevice device, const std::string& path) {
    RTCScene top = rtcNewScene(device);
    vector<RTCScene> objects;
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string kind, matrices;
        words >> kind;
        if (kind != "place") {
            objects.push_back(rtcNewScene(device));
            attach(objects.back(), object(device, words, kind));
            rtcCommitScene(objects.back());
            continue;
        }
        size_t number;
        words >> number >> matrices;
        auto m = read<float>(matrices);
        for (size_t i = 0; i < m.size(); i += 12) {
            RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
            rtcSetGeometryInstancedScene(instance, objects.at(number));
            rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, &m[i]);
            attach(top, instance);
            for (int k = 0; k < 9; k++) {
                const float *a = &m[i + size_t((k / 3 + 1) % 3 * 4)], *b = &m[i + size_t((k / 3 + 2) % 3 * 4)];
                int u = (k % 3 + 1) % 3, v = (k % 3 + 2) % 3;
                cofactors.push_back(a[u] * b[v] - a[v] * b[u]);
            }
        }
    }
    rtcCommitScene(top);
    return top;
}
