// vcp_qt.hpp: a view in a window of Qt 6, header only: link vcp::vcp and Qt6::Gui, and Qt6::Widgets where
// QWidget::createWindowContainer makes a widget of it.
//
//   auto* scene = new vcp::widget::QtView(context);                    // the context was made with windows = 1
//   layout->addWidget(QWidget::createWindowContainer(scene));
//   scene->change([](vcp::widget::View& view) { view.act(VCP_VIEW_TOP); });
//
// It orbits, pans and zooms with the mouse, takes the keys of `vcp view`, and draws when something changed. It draws
// into X11 windows, natively or through XWayland (QT_QPA_PLATFORM=xcb). All in the thread of Qt's events; no exception
// leaves an event.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <QGuiApplication>
#include <QMouseEvent>
#include <QPlatformSurfaceEvent>
#include <QTimer>
#include <QWheelEvent>
#include <QWindow>

#include "vcp.hpp"

namespace vcp::widget {

class QtView : public QWindow {
public:
    /// `options`: for all views that it makes; window, display and size are its own.
    explicit QtView(Context context, vcp_view_options options = usualOptions())
        : context_(std::move(context)), options_(options) {
        setSurfaceType(QSurface::VulkanSurface);
        connect(&timer_, &QTimer::timeout, this, [this] { guarded([this] { turn(); }); });
        timer_.setSingleShot(true);
    }

    /// Smooth moves, and smaller pictures while the camera moves and a picture is slow.
    static vcp_view_options usualOptions() {
        vcp_view_options options = sized<vcp_view_options>();
        options.moving_frame_ms = 50;
        options.move_seconds = 0.3;
        return options;
    }

    /// The view; null while there is no window on the screen.
    [[nodiscard]] View* view() { return view_.get(); }
    [[nodiscard]] const Context& context() const { return context_; }
    /// Changes the view, now or as soon as there is one, and draws.
    void change(std::function<void(View&)> change) {
        if (!view_) {
            pending_.push_back(std::move(change));
            return;
        }
        guarded([&] { change(*view_); });
        wake();
    }
    /// Looks soon whether there is something to draw; call it when the context opened something.
    void wake() { timer_.start(0); }

    std::function<void(View&)> made;              ///< called when the window has a view, and again where it got another
    std::function<void(const vcp_stats&)> drawn;  ///< called after each turn
    std::function<void(const std::exception&)> failed;  ///< called with what went wrong; empty: qWarning

protected:
    void exposeEvent(QExposeEvent*) override {
        if (isExposed() && !view_) guarded([this] { begin(); });
        if (view_) wake();
    }
    void resizeEvent(QResizeEvent*) override {
        act([this](View& view) { view.resize(uint32_t(pixels(width())), uint32_t(pixels(height()))); });
    }
    void mousePressEvent(QMouseEvent* e) override {
        act([&](View& view) {
            view.press(buttonOf(e), pixels(e->position().x()), pixels(e->position().y()), modifiersOf(e->modifiers()));
        });
    }
    void mouseMoveEvent(QMouseEvent* e) override {
        act([&](View& view) { view.move(pixels(e->position().x()), pixels(e->position().y())); });
    }
    void mouseReleaseEvent(QMouseEvent* e) override {
        act([&](View& view) { view.release(buttonOf(e)); });
    }
    void wheelEvent(QWheelEvent* e) override {
        act([&](View& view) {
            view.scroll(pixels(e->position().x()), pixels(e->position().y()), e->angleDelta().y() / 120.0,
                        modifiersOf(e->modifiers()));
        });
    }
    void keyPressEvent(QKeyEvent* e) override { key(e, true); }
    void keyReleaseEvent(QKeyEvent* e) override { key(e, false); }
    bool event(QEvent* e) override {
        // The surface is destroyed with the native window, and the view before it.
        if (e->type() == QEvent::PlatformSurface && static_cast<QPlatformSurfaceEvent*>(e)->surfaceEventType() ==
                                                        QPlatformSurfaceEvent::SurfaceAboutToBeDestroyed) {
            timer_.stop();
            view_.reset();
        }
        return QWindow::event(e);
    }

private:
    [[nodiscard]] double pixels(double length) const { return length * devicePixelRatio(); }
    static vcp_button buttonOf(const QMouseEvent* e) {
        return e->button() == Qt::LeftButton ? VCP_LEFT : e->button() == Qt::RightButton ? VCP_RIGHT : VCP_MIDDLE;
    }
    static uint32_t modifiersOf(Qt::KeyboardModifiers m) {
        return (m & Qt::ShiftModifier ? VCP_SHIFT : 0u) | (m & Qt::ControlModifier ? VCP_CONTROL : 0u);
    }
    template <class Call>
    void guarded(Call call) {
        try {
            call();
        } catch (const std::exception& e) {
            if (failed)
                failed(e);
            else
                qWarning("%s", e.what());
        }
    }
    template <class Call>
    void act(Call call) {
        if (!view_) return;
        guarded([&] { call(*view_); });
        wake();
    }
    void key(const QKeyEvent* e, bool pressed) {
        if (!e->isAutoRepeat()) act([&](View& view) { view.key(uint32_t(e->key()), pressed); });
    }
    void begin() {
        auto* x11 = qGuiApp->nativeInterface<QNativeInterface::QX11Application>();
        if (!x11) throw Error(VCP_UNSUPPORTED, "this draws into windows of X11: set QT_QPA_PLATFORM=xcb");
        vcp_view_options options = options_;
        options.window_system = VCP_WINDOW_XCB;
        options.display = x11->connection();
        options.window = winId();
        options.width = uint32_t(pixels(width()));
        options.height = uint32_t(pixels(height()));
        view_ = std::make_unique<View>(context_, options);
        if (made) made(*view_);
        for (const std::function<void(View&)>& change : std::exchange(pending_, {})) change(*view_);
    }
    void turn() {
        if (!view_) return;
        const vcp_step step = view_->update();
        view_->render();
        if (drawn) drawn(view_->stats());
        if (step.wait_seconds < 1e6) timer_.start(std::max(1, int(1000 * step.wait_seconds)));
    }

    Context context_;
    vcp_view_options options_;
    std::unique_ptr<View> view_;
    std::vector<std::function<void(View&)>> pending_;
    QTimer timer_;
};

}  // namespace vcp::widget
