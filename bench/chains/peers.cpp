// The time of Pinocchio's and MuJoCo's dynamics of the chains that `cargo bench -p flexure --bench chain -- FOLDER` has written
// as URDF and `run` converted: one state a call on one core, the least of 15 runs of 50 000 calls, as there. `bench/chains/run` compiles it.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include <mujoco/mujoco.h>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/serialization.hpp>

static double microseconds(const std::function<void(int)>& call) {
  const int calls = 50000;
  double least = 1e300;
  for (int run = 0; run < 15; run++) {
    auto start = std::chrono::steady_clock::now();
    for (int k = 0; k < calls; k++) call(k);
    std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    least = std::min(least, taken.count() / calls * 1e6);
  }
  return least;
}

int main(int, char** arguments) {
  std::printf("microseconds         Pinocchio: forward  inverse  inertia matrix   MuJoCo: forward\n");
  for (std::string name : {"two links", "six joints", "seven joints", "free base + 7"}) {
    std::string path = std::string(arguments[1]) + "/" + name + ".urdf";
    bool free = name[0] == 'f';
    pinocchio::Model model;
    model.loadFromText(path + ".txt");
    pinocchio::Data data(model);
    std::vector<Eigen::VectorXd> q, v, a;
    for (int k = 0; k < 64; k++) {
      auto wave = [&](int n, double phase) {
        Eigen::VectorXd x(n);
        for (int i = 0; i < n; i++) x[i] = std::sin(phase + k + 1.7 * i);
        return x;
      };
      q.push_back(wave(model.nq, 0.1));
      if (free) q.back().segment<4>(3).normalize();
      v.push_back(wave(model.nv, 1.1));
      a.push_back(wave(model.nv, 2.1));
    }
    double forward = microseconds([&](int k) { pinocchio::aba(model, data, q[k % 64], v[k % 64], a[k % 64]); });
    double inverse = microseconds([&](int k) { pinocchio::rnea(model, data, q[k % 64], v[k % 64], a[k % 64]); });
    double inertia = microseconds([&](int k) { pinocchio::crba(model, data, q[k % 64]); });
    std::printf("%-20s %18.3f %8.3f %8.3f", name.c_str(), forward, inverse, inertia);

    char error[500] = "";
    mjModel* m = free ? nullptr : mj_loadXML(path.c_str(), nullptr, error, sizeof error);
    if (m) {
      m->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_CONSTRAINT;
      mjData* d = mj_makeData(m);
      double time = microseconds([&](int k) {
        mju_copy(d->qpos, q[k % 64].data(), m->nq);
        mju_copy(d->qvel, v[k % 64].data(), m->nv);
        mju_copy(d->qfrc_applied, a[k % 64].data(), m->nv);
        mj_forward(m, d);
      });
      std::printf(" %25.3f", time);
    }
    std::printf("%s\n", error);
  }
}
