// Articulated smarticles of three boxes and two speed motors in Project Chrono (NSC), the engine of the paper.
//
//     driver TASK.txt OUT.bin
//
// The task is words with values, see `given`; geometry, masses, poses and the angles of the schedule all come from
// there (`benchmarks/chrono/task.py`), so that this file knows the engine and the motors' rules alone. The records of
// OUT.bin are rows of doubles, see `record`; `benchmarks/chrono/records.py` reads them.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "chrono/collision/bullet/ChCollisionSystemBullet.h"
#include "chrono/functions/ChFunctionConst.h"
#include "chrono/physics/ChBody.h"
#include "chrono/physics/ChContactContainer.h"
#include "chrono/physics/ChContactMaterialNSC.h"
#include "chrono/physics/ChLinkMotorRotationSpeed.h"
#include "chrono/physics/ChSystemNSC.h"
#include "chrono/solver/ChSolverPSOR.h"

using namespace chrono;

namespace {

constexpr int LINKS = 3, BARBS = 2;      // barb 1, middle link, barb 2; the order of our frames
constexpr int PATIENCE = 20;             // findings in a row, of both barbs of a smarticle, after which one stops
constexpr double EASED = 0.5;            // of the speed, for a barb over the limit by the code's rule
constexpr double WALL = 0.01;            // m, thickness of floor and walls

using Words = std::map<std::string, std::vector<double>>;

// `name count value value …`, one after the other.
Words given(const std::string& path) {
    std::ifstream file(path);
    if (!file) throw std::runtime_error(path + ": cannot be read");
    Words words;
    std::string name;
    size_t count;
    while (file >> name >> count) {
        auto& values = words[name];
        values.resize(count);
        for (auto& value : values)
            if (!(file >> value)) throw std::runtime_error(path + ": " + name + " has fewer values than it says");
    }
    return words;
}

struct Task {
    Words words;
    const std::vector<double>& all(const std::string& name) const {
        auto found = words.find(name);
        if (found == words.end()) throw std::runtime_error("the task lacks " + name);
        return found->second;
    }
    double one(const std::string& name) const { return all(name).at(0); }
    int whole(const std::string& name) const { return static_cast<int>(std::lround(one(name))); }
};

// Links of one smarticle overlap at its hinges and never touch each other; a body's tag is its smarticle's number.
class OthersOnly : public ChCollisionSystem::BroadphaseCallback {
  public:
    bool OnBroadphase(ChCollisionModel* one, ChCollisionModel* other) override {
        auto a = one->GetContactable()->GetPhysicsItem()->GetTag();
        auto b = other->GetContactable()->GetPhysicsItem()->GetTag();
        return a != b;
    }
};

class Neighbours : public ChContactContainer::ReportContactCallback {
  public:
    std::vector<std::set<int>> of;
    explicit Neighbours(int count) : of(count) {}
    bool OnReportContact(const ChVector3d&, const ChVector3d&, const ChMatrix33<>&, double distance, double,
                         const ChVector3d& force, const ChVector3d&, ChContactable* one, ChContactable* other,
                         int) override {
        deepest = std::min(deepest, distance);
        int a = one->GetPhysicsItem()->GetTag(), b = other->GetPhysicsItem()->GetTag();
        if (force.x() > 0 && a >= 0 && b >= 0 && a != b) {
            of[a].insert(b);
            of[b].insert(a);
        }
        return true;
    }
    double deepest = 0;
};

struct Motor {
    std::shared_ptr<ChLinkMotorRotationSpeed> link;
    std::shared_ptr<ChFunctionConst> speed;
    double rate = 0, before = 0;  // rad/s, commanded; actual at the end of the step before
    double angle = 0, torque = 0, work = 0, hold = 0;
    bool halted = false;
};

}  // namespace

int main(int argc, char** argv) try {
    if (argc != 3) throw std::runtime_error("usage: driver TASK.txt OUT.bin");
    Task task{given(argv[1])};
    const double dt = task.one("time_step_s"), friction = task.one("friction"), radius = task.one("radius_m");
    const double limit = task.one("torque_limit_N_m"), most = task.one("speed_limit_rad_per_s");
    const double acceleration = task.one("acceleration_limit_rad_per_s2");  // 0: none
    const int law = task.whole("law");                                     // 0 halt, 1 stall, 2 ease
    const auto& targets = task.all("targets_rad");                         // one per step of the activity
    const int settled = task.whole("settle_steps"), begin = settled + task.whole("rest_steps");
    const int slowly = task.whole("slow_steps"), steps = task.whole("steps"), look = task.whole("look_steps");
    const int end = begin + static_cast<int>(targets.size());
    const auto &sizes = task.all("link_sizes_m"), &masses = task.all("link_masses_kg");
    const auto &inertias = task.all("link_inertias_kg_m2"), &poses = task.all("poses");
    const int count = static_cast<int>(poses.size()) / (LINKS * 7);

    ChSystemNSC system;
    system.SetCollisionSystemType(ChCollisionSystem::Type::BULLET);
    // After the collision system: its type sets them to 0.03 and 0.01 m.
    ChCollisionModel::SetDefaultSuggestedEnvelope(task.one("envelope_m"));
    ChCollisionModel::SetDefaultSuggestedMargin(task.one("margin_m"));
    ChCollisionSystemBullet::SetContactBreakingThreshold(task.one("breaking_threshold_m"));
    system.GetCollisionSystem()->RegisterBroadphaseCallback(chrono_types::make_shared<OthersOnly>());
    system.SetGravitationalAcceleration(ChVector3d(0, 0, -task.one("gravity_m_per_s2")));
    auto solver = chrono_types::make_shared<ChSolverPSOR>();
    solver->SetMaxIterations(task.whole("iterations"));
    solver->SetTolerance(task.one("tolerance"));
    solver->EnableWarmStart(task.whole("warm_start") != 0);
    system.SetSolver(solver);
    system.SetNumThreads(1, 1, 1);
    auto material = chrono_types::make_shared<ChContactMaterialNSC>();
    material->SetFriction(static_cast<float>(friction));
    material->SetRestitution(0);

    auto box = [&](double x, double y, double z) {
        return chrono_types::make_shared<ChCollisionShapeBox>(material, x, y, z);
    };
    std::vector<std::shared_ptr<ChBody>> bodies;
    std::vector<Motor> motors;
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < LINKS; k++) {
            const double* pose = &poses[7 * (LINKS * i + k)];
            auto body = chrono_types::make_shared<ChBody>();
            body->SetTag(i);
            body->SetMass(masses[k]);
            body->SetInertiaXX(ChVector3d(inertias[3 * k], inertias[3 * k + 1], inertias[3 * k + 2]));
            body->SetPos(ChVector3d(pose[0], pose[1], pose[2]));
            body->SetRot(ChQuaterniond(pose[3], pose[4], pose[5], pose[6]));
            body->AddCollisionShape(box(sizes[3 * k], sizes[3 * k + 1], sizes[3 * k + 2]));
            body->EnableCollision(true);
            system.AddBody(body);
            bodies.push_back(body);
        }
        const auto& middle = bodies[LINKS * i + 1];
        for (int barb = 0; barb < BARBS; barb++) {
            Motor motor;
            motor.link = chrono_types::make_shared<ChLinkMotorRotationSpeed>();
            motor.speed = chrono_types::make_shared<ChFunctionConst>(0.0);
            // The axis along which a turn raises the angle: against the normal for barb 1, along it for barb 2.
            const double side = barb ? 1 : -1;
            ChVector3d hinge = middle->GetPos() + middle->GetRot().Rotate(ChVector3d(side * sizes[3] / 2, 0, 0));
            auto turned = barb ? middle->GetRot() : middle->GetRot() * QuatFromAngleX(CH_PI);
            motor.link->Initialize(bodies[LINKS * i + 2 * barb], middle, ChFramed(hinge, turned));
            motor.link->SetSpeedFunction(motor.speed);
            motor.link->AvoidAngleDrift(false);  // the rate is set from the actual angle, as in the paper's code
            system.AddLink(motor.link);
            motor.angle = motor.hold = task.one("angle_rad");
            motors.push_back(motor);
        }
    }
    // Heights of zero: no container, for the checks.
    const double height = task.one("wall_height_m");
    const int facets = height > 0 ? task.whole("facets") : 0;
    auto fixed = [&](double x, double y, double z, const ChVector3d& at, double turn) {
        auto body = chrono_types::make_shared<ChBody>();
        body->SetTag(-1);
        body->AddCollisionShape(box(x, y, z));
        body->EnableCollision(true);
        body->SetPos(at);
        body->SetRot(QuatFromAngleZ(turn));
        body->SetFixed(true);
        system.AddBody(body);
    };
    if (facets) fixed(4 * radius, 4 * radius, WALL, ChVector3d(0, 0, -WALL / 2), 0);
    for (int k = 0; k < facets; k++) {
        const double turn = 2 * CH_PI * k / facets, at = radius + WALL / 2;
        const double wide = 2 * at * std::tan(CH_PI / facets) * 1.3;  // neighbours overlap outside
        fixed(WALL, wide, height, ChVector3d(at * cos(turn), at * sin(turn), height / 2), turn);
    }
    if (task.whole("held")) bodies[1]->SetFixed(true);  // the middle link of a single smarticle, for the checks

    const std::string path = argv[2];
    std::FILE* out = std::fopen((path + ".part").c_str(), "wb");
    if (!out) throw std::runtime_error(path + ": cannot be written");
    const auto started = std::chrono::steady_clock::now();
    double residual = 0;
    // time, wall time, contacts, deepest (negative: overlap), phase; then each link's pose, velocity, spin; then each
    // barb's angle, torque, work, halted; then how many others each smarticle touches.
    auto record = [&](int step) {
        Neighbours near(count);
        auto shared = std::shared_ptr<Neighbours>(&near, [](Neighbours*) {});
        system.GetContactContainer()->ReportAllContacts(shared);
        std::chrono::duration<double> wall = std::chrono::steady_clock::now() - started;
        std::vector<double> row{step * dt, wall.count(), double(system.GetNumContacts()), near.deepest,
                                double(step <= settled ? 0 : step <= begin ? 1 : step <= end ? 2 : 3)};
        for (const auto& body : bodies) {
            const auto &p = body->GetPos(), v = body->GetPosDt(), w = body->GetAngVelParent();
            const auto q = body->GetRot();
            for (double value : {p.x(), p.y(), p.z(), q.e0(), q.e1(), q.e2(), q.e3(), v.x(), v.y(), v.z(), w.x(), w.y(),
                                 w.z()})
                row.push_back(value);
        }
        for (const auto& motor : motors)
            for (double value : {motor.angle, motor.torque, motor.work, double(motor.halted)}) row.push_back(value);
        for (const auto& others : near.of) row.push_back(double(others.size()));
        std::fwrite(row.data(), sizeof(double), row.size(), out);
        std::fflush(out);
        if (step % (20 * look) == 0) {
            std::printf("t = %.3f s, wall %.0f s, %d contacts\n", step * dt, wall.count(), system.GetNumContacts());
            std::fflush(stdout);
        }
    };
    record(0);
    std::vector<int> over(count, 0);
    for (int step = 0; step < steps; step++) {
        const bool active = step >= begin && step < end;
        // What overlaps in poses of another engine is let apart slowly.
        system.SetMaxPenetrationRecoverySpeed(task.one(step < slowly ? "settle_recovery_m_per_s" : "recovery_m_per_s"));
        for (size_t m = 0; m < motors.size(); m++) {
            auto& motor = motors[m];
            const double goal = active ? targets[step - begin] : motor.hold;
            double rate = std::clamp((goal - motor.angle) / dt, -most, most);
            motor.halted = false;
            if (active) {
                const bool beyond = std::abs(motor.torque) >= limit;
                if (law == 2) {
                    auto& found = over[m / BARBS];
                    found = beyond ? found + 1 : 0;
                    if (beyond) rate = std::clamp(rate, -EASED * most, EASED * most);
                    motor.halted = beyond && found >= PATIENCE;
                } else {
                    if (acceleration > 0)
                        rate = std::clamp(rate, motor.rate - acceleration * dt, motor.rate + acceleration * dt);
                    motor.halted = beyond && (law == 1 || rate * motor.torque > 0);
                }
                if (motor.halted) rate = 0;
                motor.hold = motor.angle;
            }
            motor.rate = rate;
            motor.speed->SetConstant(rate);
        }
        system.DoStepDynamics(dt);
        for (auto& motor : motors) {
            motor.angle = task.one("angle_rad") + motor.link->GetMotorAngle();
            motor.torque = motor.link->GetMotorTorque();
            const double now = motor.link->GetMotorAngleDt();
            // An impulse changes the rate from one to the other: exact in jumps too.
            if (active) motor.work += motor.torque * dt * (motor.before + now) / 2;
            motor.before = now;
            if (step + 1 == end) motor.hold = motor.angle;
            residual = std::max(residual, std::abs(now - motor.rate));
        }
        if ((step + 1) % look == 0) record(step + 1);
    }
    std::fclose(out);
    std::rename((path + ".part").c_str(), path.c_str());
    std::printf("done, largest difference of actual and commanded rate %.3g rad/s\n", residual);
    return 0;
} catch (const std::exception& error) {
    std::cerr << "driver: " << error.what() << std::endl;
    return 1;
}
