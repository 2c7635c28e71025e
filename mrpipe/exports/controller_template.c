/* Controller of law @LAW@, written by mrpipe; see controller.h and README.md.
 *
 * Figure 5.3: kinematic Kalman filter, control law, clipping (P2 22), inverse damper (P2 23), switch (P2 24), low-pass,
 * limits. All constants are in `numbers` and `layout`.
 */
#include "controller.h"

#include <math.h>

@PRECISION@
@MACROS@

/* In memory that can be written, so that gains and limits can be changed at run time: @PREFIX@_controller_parameters */
static double numbers[] = {
@NUMBERS@
};

static const int layout[] = {@LAYOUT@};

static double larger(double a, double b) { return a > b ? a : b; }
static double smaller(double a, double b) { return a < b ? a : b; }

static int guard(double *state, const double *measured)
{
    double *good = state + layout[STATE_GOOD];
    const double *limits = numbers + layout[AT_LIMITS];
    int refused = 0;
    for (int channel = 0; channel < layout[CHANNELS]; ++channel) {
        if (limits[channel] <= 0.0) continue;
        /* the comparison is false for a reading that is not a number */
        if (fabs(measured[channel]) <= limits[channel])
            good[channel] = measured[channel];
        else
            refused = 1;
    }
    if (!refused) {
        if (state[S_FAULTS] > layout[HOLD])
            for (int index = 0; index < layout[STATE_GOOD]; ++index) state[index] = 0.0;
        state[S_FAULTS] = 0.0;
        state[S_READY] = 1.0;
        return 0;
    }
    state[S_FAULTS] = smaller(state[S_FAULTS] + 1.0, 1e9);
    return state[S_READY] < 0.5 || state[S_FAULTS] > layout[HOLD] ? 2 : 1;
}

static void estimate(double *state, const double *measured)
{
    const double x = measured[MEASURED_DISPLACEMENT], a = measured[MEASURED_ACCELERATION], dt = numbers[SAMPLE_TIME];
    const int source = layout[VELOCITY_SOURCE];
    if (state[S_STARTED] < 0.5) {
        state[S_X] = x;
        state[S_V] = source == VELOCITY_MEASURED ? measured[MEASURED_VELOCITY] : 0.0;
        state[S_BIAS] = 0.0;
        state[S_ACCELERATION] = a;
        state[S_DISPLACEMENT] = x;
        return;
    }
    if (source == VELOCITY_MEASURED) {
        state[S_X] = x;
        state[S_V] = measured[MEASURED_VELOCITY];
    } else if (source == VELOCITY_DIFFERENCE) {
        state[S_X] = x;
        state[S_V] = (x - state[S_DISPLACEMENT]) / dt;
    } else {
        const double mean = 0.5 * (a + state[S_ACCELERATION]) - state[S_BIAS];
        const double predicted = state[S_X] + dt * state[S_V] + 0.5 * dt * dt * mean;
        const double innovation = x - predicted;
        state[S_X] = predicted + numbers[KALMAN] * innovation;
        state[S_V] = state[S_V] + dt * mean + numbers[KALMAN + 1] * innovation;
        state[S_BIAS] = state[S_BIAS] + numbers[KALMAN + 2] * innovation;
    }
    state[S_ACCELERATION] = a;
    state[S_DISPLACEMENT] = x;
}

static void follow_motion(double *state)
{
    const double x = state[S_X], v = state[S_V];
    if (fabs(v) > numbers[DEAD_BAND]) state[S_DIRECTION] = v > 0.0 ? 1.0 : -1.0;
    if (state[S_STARTED] < 0.5) {
        state[S_SEEKING] = v >= 0.0 ? 1.0 : -1.0;
        state[S_EXTREME] = x;
        state[S_AMPLITUDE] = fabs(x);
        return;
    }
    state[S_AGE] += numbers[SAMPLE_TIME];
    const double seeking = state[S_SEEKING];
    if (seeking * x > seeking * state[S_EXTREME]) state[S_EXTREME] = x;
    const double step = larger(numbers[EXTREMUM_STEP], numbers[EXTREMUM_SHARE] * state[S_AMPLITUDE]);
    if (seeking * (state[S_EXTREME] - x) > step) {
        state[S_AMPLITUDE] = fabs(state[S_EXTREME]);
        state[S_SEEKING] = -seeking;
        state[S_EXTREME] = x;
        state[S_AGE] = 0.0;
    } else if (state[S_AGE] > numbers[MEMORY]) {
        state[S_AMPLITUDE] = fabs(state[S_EXTREME]);
        state[S_SEEKING] = v >= 0.0 ? 1.0 : -1.0;
        state[S_EXTREME] = x;
        state[S_AGE] = 0.0;
    }
}

static void remember(double *state, double x, double v, double a, double force)
{
    const int length = layout[HISTORY];
    const double values[4] = {x, v, a, force};
    for (int channel = 0; channel < 4; ++channel) {
        double *past = state + layout[STATE_HISTORY] + channel * length;
        if (state[S_STARTED] < 0.5)
            for (int index = 0; index < length; ++index) past[index] = values[channel];
        for (int index = length - 1; index > 0; --index) past[index] = past[index - 1];
        past[0] = values[channel];
    }
}

static double evaluate(const double *state, int where, double spacing)
{
    double signal[WIDEST] = {0.0}, result[WIDEST] = {0.0};
    const int past = layout[where + NET_PAST], width = layout[where + NET_NEURONS];
    int at = layout[where + NET_AT], row = 0;
    for (int channel = 0; channel < layout[where + NET_CHANNELS]; ++channel) {
        const double *base = state + layout[STATE_HISTORY] + layout[where + NET_CODES + channel] * layout[HISTORY];
        for (int lag = 0; lag <= past; ++lag) {
            const double place = lag * spacing;
            const int left = (int)place;
            const double share = place - left;
            double value = base[left];
            if (share > 1e-9) value = (1.0 - share) * value + share * base[left + 1];
            if (layout[where + NET_ABSOLUTE] == 1) value = fabs(value);
            signal[row] = (value - numbers[at + width + row]) / numbers[at + row];
            ++row;
        }
    }
    at += 2 * width;
    const double output_scale = numbers[at], output_shift = numbers[at + 1];
    at += 2;
    const int layers = layout[where + NET_LAYERS];
    for (int layer = 0; layer < layers; ++layer) {
        const int inner = layout[where + NET_NEURONS + layer], outer = layout[where + NET_NEURONS + layer + 1];
        for (int neuron = 0; neuron < outer; ++neuron) {
            double total = numbers[at + outer * inner + neuron];
            for (int index = 0; index < inner; ++index) total += numbers[at + neuron * inner + index] * signal[index];
            result[neuron] = layer < layers - 1 ? tanh(total) : total;
        }
        for (int neuron = 0; neuron < outer; ++neuron) signal[neuron] = result[neuron];
        at += outer * (inner + 1);
    }
    return signal[0] * output_scale + output_shift;
}

static double look_up(double speed, double force)
{
    const int drives = layout[TABLE_DRIVES], last = layout[TABLE_SPEEDS] - 1;
    const double place = smaller(speed / numbers[TABLE_SPEED], 1.0) * last;
    const int row = (int)place < last - 1 ? (int)place : last - 1;
    const double share = place - row;
    const double *table = numbers + layout[AT_TABLE] + row * drives;
    double before = 0.0;
    for (int index = 0; index < drives; ++index) {
        const double value = (1.0 - share) * table[index] + share * table[drives + index];
        if (value >= force) {
            if (index == 0) return 0.0;
            return numbers[TABLE_DRIVE] / (drives - 1) * (index - 1 + (force - before) / larger(value - before, 1e-12));
        }
        before = value;
    }
    return numbers[TABLE_DRIVE];
}

@LAW_HELPERS@static double law(double *state, const double *measured)
{
    (void)state;
    (void)measured;
@LAW_BODY@}

static double inverse(const double *state, double force)
{
    if (layout[OUTPUT] == OUTPUT_DRIVE) return state[S_REQUEST];
    if (layout[INVERSE] == INVERSE_TABLE) return look_up(fabs(state[S_V]), fabs(force));
    if (layout[INVERSE] == INVERSE_NETWORK) return evaluate(state, layout[NETWORK_INVERSE], numbers[INVERSE_SPACING]);
    return 0.0;
}

double *@PREFIX@_controller_parameters(void) { return numbers; }

void @PREFIX@_controller_reset(double state[@UPPER@_STATE_SIZE])
{
    for (int index = 0; index < @UPPER@_STATE_SIZE; ++index) state[index] = 0.0;
}

void @PREFIX@_controller_step(double state[@UPPER@_STATE_SIZE],
                              const double measured[@UPPER@_MEASURED_SIZE],
                              double command[@UPPER@_COMMAND_SIZE])
{
    const int fault = guard(state, measured);
    if (fault == 2) {
        for (int index = 0; index < COMMAND_SIZE; ++index) command[index] = 0.0;
        command[COMMAND_DRIVE] = numbers[SAFE_DRIVE];
        command[COMMAND_DISPLACEMENT] = state[S_X];
        command[COMMAND_VELOCITY] = state[S_V];
        command[COMMAND_AMPLITUDE] = state[S_AMPLITUDE];
        command[COMMAND_FAULT] = 2.0;
        return;
    }
    const double *readings = state + layout[STATE_GOOD];
    estimate(state, readings);
    follow_motion(state);
    remember(state, state[S_X], state[S_V], readings[MEASURED_ACCELERATION], 0.0);
    const double wanted = law(state, readings);
    const int direct = layout[OUTPUT] == OUTPUT_DRIVE;
    const int clipped = !direct && wanted * state[S_DIRECTION] < 0.0;
    const double force = clipped ? 0.0 : wanted;
    double *forces = state + layout[STATE_HISTORY] + 3 * layout[HISTORY];
    forces[0] = force;
    if (state[S_STARTED] < 0.5)
        for (int index = 0; index < layout[HISTORY]; ++index) forces[index] = force;
    const double asked = inverse(state, force);
    const int switched = !direct && fabs(force) < numbers[RESIDUAL_FORCE];
    const double drive = switched ? 0.0 : asked;
    if (state[S_STARTED] < 0.5 && direct) {
        state[S_FILTER] = drive * (1.0 - numbers[LOW_PASS]);
        state[S_FILTER + 1] = drive * (numbers[LOW_PASS + 2] - numbers[LOW_PASS + 4]);
    }
    const double filtered = numbers[LOW_PASS] * drive + state[S_FILTER];
    state[S_FILTER] = numbers[LOW_PASS + 1] * drive - numbers[LOW_PASS + 3] * filtered + state[S_FILTER + 1];
    state[S_FILTER + 1] = numbers[LOW_PASS + 2] * drive - numbers[LOW_PASS + 4] * filtered;
    state[S_FORCE] = force;
    state[S_STARTED] = 1.0;
    command[COMMAND_DRIVE] = smaller(larger(filtered, 0.0), numbers[DRIVE_LIMIT]);
    command[COMMAND_FORCE] = force;
    command[COMMAND_UNCLIPPED] = wanted;
    command[COMMAND_DISPLACEMENT] = state[S_X];
    command[COMMAND_VELOCITY] = state[S_V];
    command[COMMAND_AMPLITUDE] = state[S_AMPLITUDE];
    command[COMMAND_CLIPPED] = clipped ? 1.0 : 0.0;
    command[COMMAND_SWITCHED] = switched ? 1.0 : 0.0;
    command[COMMAND_INVERSE] = asked;
    command[COMMAND_FAULT] = fault;
}
