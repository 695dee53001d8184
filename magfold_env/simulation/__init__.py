"""Simulation of scenes: conversion to arrays, single runs, batches, and results."""
